#!/usr/bin/env python3
"""A project outside of corpuscle, docs/own_law, against an installed tree; and corpuscle as a folder of another project.

    tests/outside.py BUILD_FOLDER

Installs the build into a folder of its own, builds the project with find_package there, and runs it: with a hardening of zero its law is
the built-in neo-Hookean one, and the table must be that of the program's own run; with a positive one the capsule is drawn out less.
"""
import csv
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
SMALL = """title = "Capsule"
[time]
step_us = 200
end_us = 4000
[grid]
generator = "box"
nodes = [17, 17, 17]
lower_um = [-8, -8, -8]
upper_um = [8, 8, 8]
[fluid]
convection = false
[[boundary]]
side = "j_min"
type = "moving_wall"
velocity_mm_per_s = [-1.6, 0, 0]
[[boundary]]
side = "j_max"
type = "moving_wall"
velocity_mm_per_s = [1.6, 0, 0]
""" + "".join(f'[[boundary]]\nside = "{side}"\ntype = "periodic"\n' for side in ("i_min", "i_max", "k_min", "k_max")) + """
[[cells]]
center_um = [0, 0, 0]
shape = "sphere"
radius_um = 3
vertices = 162
law = "neo-hookean"
shear_modulus_uN_per_m = 1.1
bending_modulus_J = 0
[coupling]
scheme = "force"
"""


def start(*command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: ended with {done.returncode}\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}")
    return done.stdout


def cached(build, name):
    return re.search(rf"^{name}:\w+=(.*)$", (build / "CMakeCache.txt").read_text(), re.M).group(1)


def lengths(path, column):
    with open(path) as file:
        return [float(row[column]) for row in csv.DictReader(file)]


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        tree, own = work / "tree", work / "own"
        start("cmake", "--install", build, "--prefix", tree)
        assert "corpuscle " in start(tree / "bin" / "corpuscle", "--version")
        assert (tree / "share" / "corpuscle" / "cases" / "straight_tube.toml").exists()
        same = [f"-DCMAKE_CXX_COMPILER={cached(build, 'CMAKE_CXX_COMPILER')}", "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release"]
        start("cmake", "-S", ROOT / "docs" / "own_law", "-B", own, f"-DCMAKE_PREFIX_PATH={tree}", *same)
        start("cmake", "--build", own)
        case = work / "capsule.toml"
        case.write_text(SMALL)
        for hardening in (0, 1):
            start(own / "own_law", case, hardening, work / f"{hardening}.csv")
        start(tree / "bin" / "corpuscle", "run", case, "--out", work / "out", "--set", "output.fields=false", "--set", "output.cells=false")
        theirs, ours = lengths(work / "out" / "history.csv", "elastic_energy_fJ"), lengths(work / "0.csv", "energy_fJ")
        harder = lengths(work / "1.csv", "length_um"), lengths(work / "0.csv", "length_um")
        assert len(ours) == 20, len(ours)
        assert theirs[-len(ours):] and all(abs(a - b) <= 1e-9 * max(theirs) for a, b in zip(theirs[-len(ours):], ours)), (theirs, ours)
        assert ours[-1] > 1e-3 and 6.3 < harder[0][-1] < harder[1][-1] - 0.02, harder
        page = start(tree / "bin" / "corpuscle", "report", work / "out")
        assert (work / "out" / "report.html").stat().st_size > 10000, page
        for asked, languages, words in (("9.0", "C CXX", "9.0"), ("0.1", "CXX", "LANGUAGES C CXX")):
            refused = work / f"refused_{asked}"
            refused.mkdir()
            (refused / "CMakeLists.txt").write_text(f"cmake_minimum_required(VERSION 3.21)\nproject(refused LANGUAGES {languages})\n"
                                                    f"find_package(corpuscle {asked} REQUIRED)\n")
            said = subprocess.run(["cmake", "-S", refused, "-B", refused / "build", f"-DCMAKE_PREFIX_PATH={tree}", *same], capture_output=True, text=True)
            assert said.returncode != 0 and words in " ".join(said.stderr.split()), said.stderr
        # As a folder of another project: configured, its targets known; compiling it again would take minutes.
        (work / "parent").mkdir()
        (work / "parent" / "CMakeLists.txt").write_text(
            f'cmake_minimum_required(VERSION 3.21)\nproject(parent LANGUAGES C CXX)\nadd_subdirectory("{ROOT}" corpuscle)\n'
            "if(TARGET test_fluid OR NOT TARGET corpuscle::corpuscle)\n  message(FATAL_ERROR \"not what a project wants of it\")\nendif()\n")
        start("cmake", "-S", work / "parent", "-B", work / "parent" / "build", f"-DCORPUSCLE_DEPS={cached(build, 'CORPUSCLE_DEPS')}", *same)
    print("outside: installed, found, built, run")


if __name__ == "__main__":
    main()
