#!/usr/bin/env python3
"""Every study ends with its page, whatever the time allowed: study_pages.py STUDY, with CORPUSCLE naming the program.

Started by ctest. Exit code 77, which ctest takes as skipped, where no Python has what the studies need.
"""
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
# By study: its page, and runs of it (options, what the page must say). A twelfth of a minute and less ends some in the middle.
ALL = "not run: out of time"
STUDIES = {
    "error_vs_time": ("error_vs_time.md", [
        (["--quick", "--minutes", "0"], ["# Error against wall time", " 0 of ", ALL, "Cell in the straight tube", "Pack of cells in shear"]),
        (["--quick", "--problem", "e_stretching", "--minutes", "0.11"], ["Stretching to 200 pN", ALL, "The reference did not"]),
        (["--quick", "--problem", "k_two_cells", "--minutes", "0.1"], ["Two cells pressed together", ALL, "The references did not"])]),
    "stability": ("stability.md", [
        (["--quick", "--minutes", "0"], ["# Stability map", ALL]),
        (["--quick", "--axis", "tolerances", "--minutes", "0.1"], ["# Stability map", "not run"]),
        (["--quick", "--axis", "push", "--minutes", "0.15"], ["# Stability map", "not run"])]),
    "kernels": ("kernels.md", [(["--minutes", "0"], ["# Kernels of", ALL]), (["--minutes", "0.005"], ["# Kernels of", ALL])]),
    "busy": ("busy.md", [(["--minutes", "0"], ["# The tube beside", "No ratio", ALL]),
                         (["--minutes", "0.03"], ["# The tube beside", "No ratio", ALL])]),
    "pack": ("pack.md", [(["--minutes", "0"], ["# Dense packs in shear", "| 1000 |", ALL, "5.38 (at 124 /s)"]),
                         (["--quick", "--slip", "false", "--minutes", "0.03"], ["# Dense packs in shear", ALL])]),
    "scaling": ("scaling.md", [
        (["--quick", "--minutes", "0"], ["# How runs grow", "| blood tube | weak |", "| 27 | 36 x 36 x 36 |", "1000 H200", ALL]),
        (["--quick", "--part", "counts", "--part", "model", "--ranks", "2", "--minutes", "0.5"],
         ["| 2 | 12 x 12 x 24 | 12 |", "not run", "limited by"])]),
    "two_cells": ("two_cells.md", [(["--minutes", "0"], ["# Two red cells", "| 0.5 | 0.33 | 1000 | 20 |", ALL]),
                                   (["--quick", "--minutes", "0.01"], ["# Two red cells", ALL])]),
    "threads_ranks": ("threads_ranks.md", [(["--minutes", "0"], ["# The tube on", "2 ranks", ALL]),
                                           (["--minutes", "0.03"], ["# The tube on", "2 ranks", ALL])]),
    "blood_tubes": ("blood_tubes.md", [(["--quick", "--minutes", "0"], ["# Blood in tubes", ALL]),
                                       (["--quick", "--minutes", "0.05"], ["# Blood in tubes", "Fahraeus"])]),
    "cell_shear": ("cell_shear.md", [
        (["--minutes", "0"], ["# A red cell in shear", "data, Pa", "0.584 to 0.921", ALL]),
        (["--quick", "--minutes", "0.03"], ["# A red cell in shear", "0.0260, 0.0036", "stopped after", ALL])]),
    "capsule.py": ("capsule.md", [(["--minutes", "0"], ["# Capsules in shear", "skalak, 0.6, 5", ALL]),
                                  (["--minutes", "0.02"], ["# Capsules in shear", "stopped: out of time", ALL])]),
    "stiff_in_shear": ("stiff_in_shear.md", [
        (["--minutes", "0"], ["# Stiff cells in shear", "spheroid of 0.3", ALL]),
        (["--quick", "--minutes", "0.01"], ["# Stiff cells in shear", "stopped after"])]),
    "tube_cytosol": ("tube_cytosol.md", [
        (["--minutes", "0"], ["# A cell with fluid inside", "ratio 5", ALL]),
        (["--quick", "--minutes", "0.02"], ["# A cell with fluid inside", "empty, sharp", "stopped after", ALL])]),
    "membrane_transfer.py": ("membrane_transfer.md", [
        (["--minutes", "0"], ["# Membranes as forces", "x + 2 y", ALL]),
        (["--quick", "--minutes", "0.02"], ["# Membranes as forces", "stopped: out of time", ALL])]),
    "blood_memory": ("blood_memory.md", [(["--minutes", "0"], ["# What cells take of memory", "| 1600 | and contact |", ALL]),
                                         (["--cells", "4", "--minutes", "0.03"], ["# What cells take of memory"])]),
    "blood_speed": ("blood_speed.md", [(["--minutes", "0"], ["# What blood costs", "half the step", ALL]),
                                       (["--quick", "--minutes", "0.04"], ["# What blood costs", "half the step", ALL])]),
}


def start(command, **environment):
    return subprocess.run(command, env=dict(os.environ, **environment), capture_output=True, text=True, timeout=110)


def check(condition, what):
    if not condition:
        sys.exit(f"study_pages.py: {what}")


def check_study(name):
    page, runs = STUDIES[name]
    for options, parts in runs:
        with tempfile.TemporaryDirectory() as folder:
            result = start([str(ROOT / "perf" / name), *options, "--out", folder])
            said = f"{name} {' '.join(options)} says\n{result.stdout}{result.stderr}"
            if "no Python found here" in result.stderr:
                sys.exit(77)
            check(result.returncode == 0 and "Traceback" not in result.stderr, f"exit code {result.returncode}: {said}")
            check((pathlib.Path(folder) / page).exists(), f"no page: {said}")
            text = (pathlib.Path(folder) / page).read_text()
            for part in parts:
                check(part in text, f"the page does not say '{part}':\n{text}")


def check_python():
    """A first python3 on the path that has nothing, as pyenv's: the scripts go on under another."""
    with tempfile.TemporaryDirectory() as folder:
        made = start([sys.executable, "-m", "venv", "--without-pip", folder])
        if made.returncode:
            sys.exit(77)
        bare = str(pathlib.Path(folder) / "bin/python3")
        path = f"{pathlib.Path(bare).parent}:{os.environ['PATH']}"
        check(start([bare, "-c", "import h5py"]).returncode != 0, "a bare Python has h5py: this test can not fail")
        for name in ("cases/plot.py", "perf/error_vs_time", "perf/stability", "perf/compare_outlines.py"):
            result = start(["python3", str(ROOT / name), "--help"], PATH=path)
            if "no Python found here" in result.stderr:
                sys.exit(77)
            check(result.returncode == 0 and "usage:" in result.stdout, f"{name} under a bare Python says\n"
                  f"{result.stdout}{result.stderr}")
        script = f"import sys; sys.path.insert(0, '{ROOT}/cases'); sys.argv = ['x.py']\nimport python_with\n"
        result = start([bare, "-c", script + "python_with.need('no_such_module')"], PATH=path)
        check(result.returncode == 1 and "x.py: no Python found here has no_such_module" in result.stderr
              and f"{bare} -m pip install no_such_module" in result.stderr, f"no advice: {result.stderr}")


def check_plot():
    """Results that cannot be drawn: one line that says why, and exit code 2."""
    plot = [sys.executable, str(ROOT / "cases/plot.py")]
    if "no Python found here" in start([*plot, "--help"]).stderr:
        sys.exit(77)
    with tempfile.TemporaryDirectory() as folder:
        run = pathlib.Path(folder) / "run"
        words = ["run", str(ROOT / "cases/couette.toml"), "--out", str(run)]
        for setting in ("grid.nodes=[5,5,5]", "time.end_us=2", "output.every_us=1"):
            words += ["--set", setting]
        check(start([os.environ["CORPUSCLE"], *words]).returncode == 0, "the run failed")
        check(start([*plot, str(run)]).returncode == 0 and (run / "velocity.png").exists(), "a whole run cannot be drawn")

        def refuse(parts, *options):
            result = start([*plot, str(run), *options])
            lines = result.stderr.strip().splitlines()
            check(result.returncode == 2 and len(lines) == 1 and all(part in lines[0] for part in parts),
                  f"exit code {result.returncode}, not one line with {parts}:\n{result.stdout}{result.stderr}")

        blood = pathlib.Path(folder) / "blood"
        words = ["run", str(ROOT / "cases/capsule_shear.toml"), "--out", str(blood)]
        for setting in ("grid.nodes=[17,17,17]", "time.end_us=400", "cells.0.vertices=200", "blood.from_us=200", "blood.sample_every_us=100", "output.fields=false"):
            words += ["--set", setting]
        check(start([os.environ["CORPUSCLE"], *words]).returncode == 0, "the run with [blood] failed")
        drawn = start([*plot, str(blood)])
        check(drawn.returncode == 0 and (blood / "blood.png").exists(), "samples of blood cannot be drawn")
        check(drawn.stderr == "", f"drawing blood complains of itself:\n{drawn.stderr}")
        refuse(["cannot be made a folder"], "--out", str(run / "report.json" / "below"))
        refuse(["/proc/velocity.png", "cannot be written"], "--out", "/proc")
        history = run / "history.csv"
        for content, parts in ((b"time_us,cell,x\n0,0,1\n1,0,much\n", ["history.csv, line 3", "much"]),
                               (bytes(range(256)), ["history.csv", "cannot be read as text"]),
                               (b"a,b\n1,2\n", ["history.csv", "names no time_us"])):
            history.write_bytes(content)
            refuse(parts)
        history.unlink()
        (run / "fields/step_000000001.h5").unlink()
        refuse(["fields.h5", "fields/step_000000001.h5", "missing"])


if __name__ == "__main__":
    {"python": check_python, "plot": check_plot}.get(sys.argv[1], lambda: check_study(sys.argv[1]))()
