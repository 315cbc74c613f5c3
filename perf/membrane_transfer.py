#!/usr/bin/env python3
"""How membranes pass forces to the fluid, beside exact solutions: three tables, to perf/results/membrane_transfer.md.

    perf/membrane_transfer.py [BUILD_FOLDER]

1. Currents at rest and the jump of pressure under a uniform normal load.
2. The radius that the fluid sees of a sphere under a uniform force (Hasimoto, J. Fluid Mech. 5, 1959).
3. The slip along plates under a tangential force, from which the slip correction's constants are.
"""
import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "build/openmp") / "perf/membrane_transfer"


def run(*words):
    done = subprocess.run([str(PROGRAM), *map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))}: {done.stderr.strip()}")
    return json.loads(done.stdout)


def table(head, rows):
    return ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)] + ["| " + " | ".join(row) + " |" for row in rows]


def rest():
    rows = []
    for kernel in ("three", "four"):
        for grid, a, axes in [("box", 5, (1, 1, 1)), ("box", 5, (1.3, 1, 0.77)), ("tube", 5, (1, 1, 1)), ("tube", 5, (1.3, 1, 0.77)),
                              ("box", 10, (1, 1, 1)), ("tube", 10, (1.3, 1, 0.77))]:
            if kernel == "four" and (grid, a) != ("box", 5):
                continue
            r = run("rest", kernel, grid, a, *axes)
            rows.append([kernel, grid, str(a), " : ".join(map(str, axes)), f"{r['speed_at_vertices']:.1e}", f"{r['speed_in_cells']:.1e}",
                         f"{r['jump']:.4f}"])
    return table(["kernel", "grid", "a/h", "semi-axes", "largest speed of a vertex", "in cells", "jump of pressure"], rows)


def spheres():
    rows = []
    cases = [("three", a, (1, 1, 1), (1, 0, 0)) for a in (1.5, 2.5, 5, 8)] + [("three", 2.5, (1, 1, 1), (1, 1, 1))]
    cases += [("three", a, ratio, force) for a in (1.5, 2.5) for ratio in ((1, 1, 2), (1, 1, 3), (3, 1, 3)) for force in ((1, 0, 0), (0, 0, 1), (1, 1, 1))]
    cases += [("four", 2.5, (1, 1, 1), (1, 0, 0)), ("four", 2.5, (1, 1, 3), (1, 0, 0))]
    for kernel, a, ratio, force in cases:
        r = run("sphere", kernel, a, *ratio, *force)
        rows.append([kernel, str(a), " : ".join(map(str, ratio)), str(list(force)), f"{r['error_h']:+.3f}",
                     f"{r['with_slip_h']:+.3f} ({r['slip_from']:+.3f} to {r['slip_to']:+.3f})"])
    return table(["kernel", "a/h", "spacings", "force along", "radius too large by, h", "with slip (places in the grid)"], rows)


def plates():
    rows = []
    for kernel in ("three", "four"):
        for ratio in ((1, 1), (2, 1), (3, 1), (1, 3)):
            for m in (0, 1, 2):
                if kernel == "four" and ratio != (1, 1):
                    continue
                r = run("plates", kernel, *ratio, m, 0.3)
                rows.append([kernel, " : ".join(map(str, ratio)), f"x + {m} y", f"{r['slip_over_spacing']:.3f}", f"{r['law']:.3f}"])
    return table(["kernel", "spacings", "plate", "slip over the spacing along its normal", "the correction's"], rows)


def main():
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    lines = ["# Membranes as forces, beside exact solutions", "",
             "From `perf/membrane_transfer.py`. Radius and viscosity are one, h is the largest of the grid's spacings.", "",
             "## At rest under a unit normal load", ""] + rest() + ["", "## A sphere under a uniform force", ""] + spheres()
    lines += ["", "## Plates under a tangential force", ""] + plates()
    (ROOT / "perf/results/membrane_transfer.md").write_text("\n".join(lines) + "\n")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
