#!/usr/bin/env python3
"""How membranes pass forces to the fluid, beside exact solutions: three tables.

    perf/membrane_transfer.py [--quick] [--minutes M] [--out DIR]

1. Currents at rest and the jump of pressure under a uniform normal load.
2. The radius that the fluid sees of a sphere under a uniform force (Hasimoto, J. Fluid Mech. 5, 1959).
3. The slip along plates under a tangential force, from which the slip correction's constants are.
Writes DIR/membrane_transfer.md (perf/results) after every row. --quick: the coarsest grid of each.
"""
import argparse
import json
import os
import pathlib
import subprocess

import study


class Program:
    """perf/membrane_transfer, as long as there is time."""

    def __init__(self, minutes):
        self.limit = study.Limit(minutes)

    def run(self, *words):
        """What it found, or why it did not."""
        if not self.limit.allows():
            return None, study.NO_TIME
        command = [str(study.study_program("membrane_transfer")), *map(str, words)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=self.limit.left_s,
                                  env=dict(os.environ, OMP_NUM_THREADS=os.environ.get("OMP_NUM_THREADS", "1"), OMP_PROC_BIND="false"))
        except subprocess.TimeoutExpired:
            return None, "stopped: out of time"
        if done.returncode != 0:
            return None, f"failed: {done.stderr.strip().splitlines()[-1][:200] if done.stderr.strip() else done.returncode}"
        return json.loads(done.stdout), ""


def rest(quick):
    """Rows to be: what they say for themselves, the words of the program, and what of its answer they show."""
    show = lambda r: {"largest speed of a vertex": f"{r['speed_at_vertices']:.1e}", "in cells": f"{r['speed_in_cells']:.1e}",
                      "jump of pressure": f"{r['jump']:.4f}"}
    for kernel in ("three", "four"):
        for grid, a, axes in [("box", 5, (1, 1, 1)), ("box", 5, (1.3, 1, 0.77)), ("tube", 5, (1, 1, 1)), ("tube", 5, (1.3, 1, 0.77)),
                              ("box", 10, (1, 1, 1)), ("tube", 10, (1.3, 1, 0.77))]:
            if (kernel == "four" and (grid, a) != ("box", 5)) or (quick and a > 5):
                continue
            yield {"kernel": kernel, "grid": grid, "a/h": str(a), "semi-axes": " : ".join(map(str, axes))}, ("rest", kernel, grid, a, *axes), show


def spheres(quick):
    show = lambda r: {"radius too large by, h": f"{r['error_h']:+.3f}",
                      "with slip (places in the grid)": f"{r['with_slip_h']:+.3f} ({r['slip_from']:+.3f} to {r['slip_to']:+.3f})"}
    cases = [("three", a, (1, 1, 1), (1, 0, 0)) for a in (1.5, 2.5, 5, 8)] + [("three", 2.5, (1, 1, 1), (1, 1, 1))]
    cases += [("three", a, ratio, force) for a in (1.5, 2.5) for ratio in ((1, 1, 2), (1, 1, 3), (3, 1, 3)) for force in ((1, 0, 0), (0, 0, 1), (1, 1, 1))]
    cases += [("four", a, (1, 1, 1), (1, 0, 0)) for a in (2.5, 5)] + [("four", 2.5, (1, 1, 3), (1, 0, 0))]
    for kernel, a, ratio, force in cases:
        if not quick or (a == 1.5 and ratio == (1, 1, 1)):
            yield {"kernel": kernel, "a/h": str(a), "spacings": " : ".join(map(str, ratio)), "force along": str(list(force))}, \
                ("sphere", kernel, a, *ratio, *force), show


def plates(quick):
    show = lambda r: {"slip over the spacing along its normal": f"{r['slip_over_spacing']:.3f}", "the correction's": f"{r['law']:.3f}"}
    for kernel in ("three", "four"):
        for ratio in ((1, 1), (2, 1), (3, 1), (1, 3)):
            for m in (0, 1, 2):
                if ratio == (1, 1) or (kernel == "three" and not quick):
                    yield {"kernel": kernel, "spacings": " : ".join(map(str, ratio)), "plate": f"x + {m} y"}, \
                        ("plates", kernel, *ratio, m, 0.3), show


TABLES = {"At rest under a unit normal load": rest, "A sphere under a uniform force": spheres,
          "Plates under a tangential force": plates}


def page(tables):
    where = study.provenance()
    lines = ["# Membranes as forces, beside exact solutions", "",
             f"`perf/membrane_transfer.py` on {where['date']}: {where['machine']}, git {where['git']}. Radius and viscosity are one, h is the "
             "largest of the grid's spacings.", ""]
    for title, rows in tables.items():
        columns = list(dict.fromkeys(key for row in rows for key in row))
        lines += [f"## {title}", "", study.markdown_table(rows, columns) if rows else study.NO_TIME, ""]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--out", type=pathlib.Path, default=study.RESULTS)
    study.add_limit(parser, 120)
    options = parser.parse_args()
    program, tables = Program(options.minutes), {title: [] for title in TABLES}
    options.out.mkdir(parents=True, exist_ok=True)
    for title, rows in TABLES.items():
        for row, words, show in rows(options.quick):
            found, trouble = program.run(*words)
            tables[title].append(row | (show(found) if found else {"outcome": trouble}))
            print(", ".join(tables[title][-1].values()), flush=True)
            (options.out / "membrane_transfer.md").write_text(page(tables))
    print(page(tables))


if __name__ == "__main__":
    main()
