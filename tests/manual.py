#!/usr/bin/env python3
"""The manual says what is so: its commands and cases run, and docs/results.md has every name that runs write.

    tests/manual.py PROGRAM

In docs/*.md a block ```sh holds commands, run in order, a page in a folder of its own with cases/ in it. A block ```toml is the case whose name
stands in backquotes before it; ```toml append=A file=B is A with the block behind it.
"""
import csv
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "cases"))
import python_with  # noqa: E402

python_with.need("h5py")
import h5py  # noqa: E402

PAGES = sorted((ROOT / "docs").glob("*.md"))
# Scenes beside those of the manual, for the names that they alone write.
MORE = {"obstacle": ["time.end_us=20"], "two_cells": ["time.end_us=20"], "couette": ["time.end_us=40"], "tube_flow": ["time.end_us=8"], "stretch": ["stretching.steps=2"],
        "uniform_flow": ["time.end_us=8"]}
# Entries whose own keys are of the scene.
OPEN = {"left_out_cost", "left_out", "populations", "warnings", "told", "error_bars", "modules", "error_estimate", "libraries", "machine"}


def run(command, folder, environment):
    done = subprocess.run(["bash", "-ec", command], cwd=folder, env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{command}\nended with {done.returncode}:\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}")


def play(page, folder, environment):
    """@return how many blocks were run"""
    named, count = None, 0
    for match in re.finditer(r"`([\w.]+\.toml)`(?: is|:)|^```(toml|sh)([^\n]*)\n(.*?)^```", page.read_text(), re.M | re.S):
        if match.group(1):
            named = match.group(1)
            continue
        kind, options, text = match.group(2), dict(re.findall(r"(\w+)=(\S+)", match.group(3))), match.group(4)
        count += 1
        if kind == "toml":
            before = (folder / options["append"]).read_text() if "append" in options else ""
            (folder / options.get("file", named)).write_text(before + text)
            continue
        for command in text.strip().splitlines():
            run(command, folder, environment)
    return count


def dataset_names(path):
    names = set()
    with h5py.File(path) as file:
        file.visit(lambda name: names.add(name.split("/")[-1]))
    return names


def report_names(value, names):
    for key, inner in value.items():
        names.add(key)
        if isinstance(inner, dict) and key not in OPEN:
            report_names(inner, names)


def written_names(folder):
    names = set()
    for path in folder.rglob("report.json"):
        report_names(json.loads(path.read_text()), names)
    for path in folder.rglob("*.csv"):
        if path.name in ("history.csv", "blood.csv"):
            with open(path) as file:
                names |= set(next(csv.reader(file)))
    for path in folder.rglob("*.h5"):
        if path.name != "checkpoint.h5" and path.parent.name in ("fields", "cells", "bodies", "cell_series"):
            names |= dataset_names(path)
        elif path.name == "blood.h5":
            names |= dataset_names(path)
    for path in folder.rglob("report.json"):
        names |= {entry.name for entry in path.parent.iterdir() if not entry.name.startswith(".") and not entry.name.startswith("coarser")
                  and entry.suffix not in (".png",)}
    return names


def missing(names, text):
    """Names that the page does not have: of vectors the first component stands for all, of cells and bodies the history's column."""
    lacking = []
    for name in sorted(names):
        plain = re.sub(r"^(cell|body)_\d+_", "", name)
        forms = {plain, re.sub(r"_[yz]_", "_x_", plain), re.sub(r"_error_(um|mm_per_s)$|_error$", "", plain), re.sub(r"^blood_", "", plain)}
        forms |= {re.sub(r"_[xyz]_", "_x_", plain), plain.split("_x_")[0] + "_x_"}
        if not any(re.search(rf"(?<![A-Za-z0-9_]){re.escape(form)}(?![A-Za-z0-9])", text) for form in forms):
            lacking.append(name)
    return lacking


def main():
    program = pathlib.Path(sys.argv[1]).resolve()
    environment = os.environ | {"PATH": f"{program.parent}:{os.environ['PATH']}"}
    with tempfile.TemporaryDirectory() as temporary:
        work, blocks = pathlib.Path(temporary), 0
        for page in PAGES:
            folder = work / page.stem
            folder.mkdir()
            shutil.copytree(ROOT / "cases", folder / "cases")
            blocks += play(page, folder, environment)
        assert blocks >= 10, blocks
        for name, overrides in MORE.items():
            sets = " ".join(f"--set {override}" for override in overrides)
            run(f"corpuscle run {ROOT / 'cases' / (name + '.toml')} --out {name} {sets}", work, environment)
        names = written_names(work)
        assert len(names) > 150, len(names)
        lacking = missing(names, (ROOT / "docs" / "results.md").read_text())
        if lacking:
            sys.exit(f"docs/results.md does not say what these are: {', '.join(lacking)}")
        for page in PAGES:
            for link in re.findall(r"\]\((?!http)([^)#]+)\)", page.read_text()):
                assert (page.parent / link).exists(), f"{page.name}: {link} leads nowhere"
    print(f"manual: {blocks} blocks run, {len(names)} names known")


if __name__ == "__main__":
    main()
