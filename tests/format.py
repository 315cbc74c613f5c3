#!/usr/bin/env python3
"""Every C++ file is as clang-format 14 would write it.

    tests/format.py CLANG_FORMAT [--mend]
"""
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
VERSION = "14."


def main():
    program, mend = sys.argv[1], "--mend" in sys.argv[2:]
    said = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    if f"version {VERSION}" not in said:
        print(f"skipped: {said.strip()} is not version {VERSION}x, and others set spaces otherwise")
        return 77
    files = [str(path) for folder in ("src", "kernels", "tests", "perf", "docs") for path in sorted((ROOT / folder).rglob("*"))
             if path.suffix in (".cpp", ".hpp")]
    assert len(files) > 300, len(files)
    if mend:
        subprocess.run([program, "-i", *files], check=True)
        return 0
    wrong = [path for path in files if subprocess.run([program, "--dry-run", "-Werror", path], capture_output=True).returncode != 0]
    for path in wrong:
        print(f"{path}: not as clang-format writes it: tests/format.py {program} --mend")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
