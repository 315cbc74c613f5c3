#!/usr/bin/env python3
"""Capsules in shear beside boundary integrals and small deformations: two tables, to perf/results/capsule.md.

    perf/capsule.py [--long] [BUILD_FOLDER]

1. Taylor's deformation D over time, of capsules as viscous inside as outside and five times as viscous, beside our boundary integral
   (collocation on 1280 triangles, 1 %). --long: to a shear of 10, and grids of eight spacings a radius.
2. The steady deformation at a small capillary number, 25/12 of it whatever the viscosity inside (Barthes-Biesel, J. Fluid Mech. 100,
   1980).
"""
import argparse
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PARSER = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
PARSER.add_argument("--long", action="store_true")
PARSER.add_argument("build_folder", nargs="?", type=Path, default=ROOT / "build/openmp")
OPTIONS = PARSER.parse_args()
LONG = OPTIONS.long
PROGRAM = OPTIONS.build_folder / "perf/capsule"

# (law, capillary number, inner over outer viscosity): shear to D
BOUNDARY_INTEGRAL = {
    ("neo-hookean", 0.3, 1): {0.5: 0.2018, 1: 0.3109, 1.5: 0.3628, 2: 0.3856, 3: 0.3976, 4: 0.3982},
    ("neo-hookean", 0.3, 5): {0.5: 0.0872, 1: 0.1552, 1.5: 0.2039, 2: 0.2365, 3: 0.2686, 4: 0.2768, 5: 0.2749, 6: 0.2694, 8: 0.2582,
                              10: 0.2527},
    ("skalak", 0.6, 5): {0.5: 0.0908, 1: 0.1668, 1.5: 0.2244, 2: 0.2646, 3: 0.3064, 4: 0.3184, 5: 0.3174, 6: 0.3108, 8: 0.2941},
}


def run(law, capillary, ratio, spacings, box, vertices, slip, step, until):
    """{shear: D} and the momentum iterations a step."""
    words = [law, capillary, ratio, spacings, box, vertices, int(slip), step, until]
    done = subprocess.run([str(PROGRAM), *map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))}: {done.stderr.strip()}")
    lines = done.stdout.strip().splitlines()
    return {float(t): float(d) for t, d, _ in (line.split(",") for line in lines[:-1])}, float(lines[-1].split()[1])


def transients():
    rows = []
    until = 10 if LONG else 2
    for (law, capillary, ratio), reference in BOUNDARY_INTEGRAL.items():
        for spacings, vertices in [(5, 500), (8, 1280)] if LONG else [(5, 500)]:
            for slip in (True, False):
                end = min(until, max(reference))
                d, iterations = run(law, capillary, ratio, spacings, 8, vertices, slip, 0.01 * 5 / spacings, end)
                shown = [f"{d[t]:.4f} ({100 * (d[t] / exact - 1):+.1f} %)" if t in d else "" for t, exact in reference.items() if t <= end]
                rows.append(f"| {law}, {capillary}, {ratio} | {spacings} | {'yes' if slip else 'no'} | " + " | ".join(shown) + f" | {iterations:.1f} |")
        head = [f"{t:g}: {exact:.4f}" for t, exact in reference.items() if t <= end]
        yield "| law, capillary number, ratio | a/h | slip | " + " | ".join(head) + " | iterations |"
        yield "|" + "---|" * (4 + len(head))
        yield from rows
        yield ""
        rows = []


def small():
    yield "| ratio | a/h | slip | D | over 25/12 of the capillary number |"
    yield "|" + "---|" * 5
    for ratio in (0.2, 1, 5):
        for spacings, vertices in [(5, 500), (8, 1280)] if LONG else [(5, 500)]:
            for slip in (True, False):
                end = 0.2 if ratio < 5 else 0.4
                d, _ = run("neo-hookean", 0.01, ratio, spacings, 8, vertices, slip, 0.0003 if ratio < 1 else 0.0005, end)
                last = d[max(d)]
                yield f"| {ratio} | {spacings} | {'yes' if slip else 'no'} | {last:.5f} | {last / (0.01 * 25 / 12):.3f} |"


def main():
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    lines = ["# Capsules in shear", "", "From `perf/capsule.py`. Walls and images are eight radii away from each other, a/h spacings a radius.", "",
             "## Deformation over time beside a boundary integral", ""] + list(transients())
    lines += ["## Steady deformation at a capillary number of 0.01", ""] + list(small())
    (ROOT / "perf/results/capsule.md").write_text("\n".join(lines) + "\n")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
