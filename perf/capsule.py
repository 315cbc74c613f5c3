#!/usr/bin/env python3
"""Capsules in shear beside boundary integrals, published curves and small deformations.

    perf/capsule.py [--quick] [--part PART]... [--spacings N...] [--box N] [--minutes M] [--out DIR]

Parts: `transients` at capillary number 0.3, as viscous inside as outside and five times as viscous, and Skalak's law at 0.6, beside
a boundary integral (collocation on 1280 triangles, 1 %); `capillary`, numbers of 0.0375 to 0.15 to a shear of two, beside published
curves; `small`, the steady deformation at 0.01, 25/12 of it whatever the viscosity inside (Barthes-Biesel, J. Fluid Mech. 100, 1980);
`order`, three grids each 1.5 times as fine as the one before; `box`, how near walls and images may be. The first four with both
kernels, with and without slip. Deformation is Taylor's, of the ellipsoid of equal inertia. Writes DIR/capsule.md (perf/results)
after every run. --quick: four spacings a radius, to a shear of one.
"""
import argparse
import math
import os
import pathlib
import subprocess

import study

VARIANTS = (("three-point", True), ("three-point", False), ("four-point", False))
PUBLISHED = ("rp98", "p95", "db08", "hw23")
SHOWN = (0.5, 1, 1.5, 2, 3, 4, 6, 8, 10)


class Runs:
    """Runs of perf/capsule."""

    def __init__(self, options):
        self.options, self.limit = options, study.Limit(options.minutes)

    def run(self, law, capillary, ratio, spacings, variant, until, step=None, every=0.5, box=None):
        """{shear: D}, as far as it came, and why no further ("" where it did)."""
        if not self.limit.allows():
            return {}, study.NO_TIME
        # As long as a membrane of that stiffness stands, and no longer than resolves the shear.
        step = step or 0.01 * min(1, capillary / 0.3) * min(1, 0.5 * (1 + ratio)) * min(1, 5 / spacings)
        step = every / math.ceil(every / step)
        vertices = max(162, round(500 * (spacings / 5) ** 2))
        kernel, slip = variant
        words = [law, capillary, ratio, spacings, box or self.options.box, vertices, kernel, int(slip), step, until, every]
        command = [str(study.study_program("capsule")), *map(str, words)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=self.limit.left_s,
                                  env=dict(os.environ, OMP_NUM_THREADS=os.environ.get("OMP_NUM_THREADS", "1"), OMP_PROC_BIND="false"))
            output, trouble = done.stdout, done.stderr.strip().splitlines()[-1][:200] if done.returncode else ""
        except subprocess.TimeoutExpired as stopped:
            output, trouble = (stopped.stdout or b"").decode(), "stopped: out of time"
        lines = [line.split(",") for line in output.splitlines() if line.count(",") == 2]
        return {round(float(t), 6): float(d) for t, d, _ in lines}, trouble


def variant_text(variant):
    return f"{variant[0]}, {'slip' if variant[1] else 'no slip'}"


def beside(found, exact):
    return f"{found:.4f} ({100 * (found / exact - 1):+.1f} %)"


def boundary_integral(law, capillary, ratio):
    """{shear: D}."""
    name = "skalak C=1" if law == "skalak" else law
    return {row["t"]: row["D"] for row in study.reference("capsule_boundary_integral")
            if (row["law"], row["ca_G"], row["lambda"]) == (name, capillary, ratio)}


def transients(runs, table, spacings):
    for law, capillary, ratio, until in (("neo-hookean", 0.3, 1, 4), ("neo-hookean", 0.3, 5, 10), ("skalak", 0.6, 5, 9)):
        exact = boundary_integral(law, capillary, ratio)
        for n, variant in enumerate(VARIANTS):
            end = min(until if n == 0 else 2, runs.options.until)  # the yardsticks beside the default show themselves before
            found, trouble = runs.run(law, capillary, ratio, spacings, variant, end)
            row = {"law, capillary number, ratio": f"{law}, {capillary:g}, {ratio:g}", "a/h": spacings, "": variant_text(variant)}
            row |= {f"{t:g}": beside(found[t], exact[t]) if t in found and t in exact else "" for t in SHOWN}
            table(row | {"outcome": trouble})


def capillary_numbers(runs, table, spacings):
    rows = study.reference("capsule_published")
    for capillary in (0.15, 0.075, 0.0375):
        band = {r["t"]: [r[name] for name in PUBLISHED if r[name]] for r in rows if r["ca_G"] == capillary}
        for variant in VARIANTS:
            found, trouble = runs.run("neo-hookean", capillary, 1, spacings, variant, min(2, runs.options.until))
            row = {"capillary number": capillary, "a/h": spacings, "": variant_text(variant)}
            for t in (0.5, 1, 1.5, 2):
                values = band.get(t, [])
                text = f"{found[t]:.4f}" if t in found else ""
                row[f"{t:g}"] = text + (f" ({min(values):.4f} to {max(values):.4f})" if text and values else "")
            table(row | {"outcome": trouble})


def small(runs, table, spacings):
    for ratio in (0.2, 1, 5):
        for variant in VARIANTS:
            until = 0.2 if ratio < 5 else 0.8
            found, trouble = runs.run("neo-hookean", 0.01, ratio, spacings, variant, until,
                                      (0.0003 if ratio < 1 else 0.0005) * min(1, 5 / spacings), every=until)
            d = found.get(until)
            table({"ratio": ratio, "a/h": spacings, "": variant_text(variant), "D": f"{d:.5f}" if d else "",
                   "over 25/12 of the capillary number": f"{d * 12 / 0.25:.3f}" if d else "", "outcome": trouble})


def order(runs, table, finest):
    """Of the convergence, from the differences between three grids; vertices and steps are refined with them."""
    grids = [finest / 2.25, finest / 1.5, finest]
    exact = boundary_integral("neo-hookean", 0.3, 1)[1]
    for variant in VARIANTS:
        d, trouble = [], ""
        for spacings in grids:
            found, why = runs.run("neo-hookean", 0.3, 1, spacings, variant, 1, 0.05 / spacings)
            d.append(found.get(1))
            trouble = trouble or why
        row = {"": variant_text(variant)} | {f"a/h {g:.3g}": beside(v, exact) if v else "" for g, v in zip(grids, d)}
        if all(d):
            change = (d[1] - d[0]) / (d[2] - d[1])
            row["order"] = f"{math.log(change) / math.log(1.5):.2f}" if change > 0 else "differences change their sign"
        table(row | {"outcome": trouble})


def boxes(runs, table, spacings):
    exact = boundary_integral("neo-hookean", 0.3, 1)[1]
    for box in (6, 8, 12):
        found, trouble = runs.run("neo-hookean", 0.3, 1, min(4, spacings), VARIANTS[0], 1, box=box)
        d = found.get(1)
        table({"walls and images apart, radii": box, "a/h": min(4, spacings), "D": beside(d, exact) if d else "", "outcome": trouble})


PARTS = {"transients": ("Deformation over time beside a boundary integral", transients),
         "capillary": ("Deformation over time beside the least and the largest of published curves", capillary_numbers),
         "small": ("Steady deformation at a capillary number of 0.01", small),
         "order": ("At a shear of one on three grids, capillary number 0.3", order),
         "box": ("At a shear of one in three boxes, capillary number 0.3", boxes)}
ONCE = ("order", "box")  # the others: on each grid


def columns_of(rows):
    return list(dict.fromkeys(key for row in rows for key in row))


def page(options, tables):
    where = study.provenance()
    lines = ["# Capsules in shear", "",
             f"`perf/capsule.py` on {where['date']}: {where['machine']}, git {where['git']}. Walls and images are {options.box:g} radii away "
             "from each other, a/h spacings a radius; columns named by a number are D at that shear.", ""]
    for part in options.part:
        rows = tables[part]
        lines += [f"## {PARTS[part][0]}", "", study.markdown_table(rows, columns_of(rows)) if rows else study.NO_TIME, ""]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--part", action="append", choices=PARTS, help="only this (may be repeated)")
    parser.add_argument("--spacings", type=float, nargs="+", default=[5, 8], help="of the grid, to a radius")
    parser.add_argument("--box", type=float, default=8, help="radii between walls and between images")
    parser.add_argument("--until", type=float, default=10, help="no run beyond this shear")
    parser.add_argument("--out", type=pathlib.Path, default=study.RESULTS)
    study.add_limit(parser, 600)
    options = parser.parse_args()
    if options.quick:
        options.spacings, options.box, options.until = [4], 6, 1
    options.part = options.part or list(PARTS)
    runs, tables = Runs(options), {part: [] for part in PARTS}

    def write():
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / "capsule.md").write_text(page(options, tables))

    def measure(part, spacings):
        def table(row):
            tables[part].append(row)
            print(", ".join(str(value) for value in row.values()), flush=True)
            write()
        PARTS[part][1](runs, table, spacings)

    for spacings in options.spacings:
        for part in options.part:
            if part not in ONCE:
                measure(part, spacings)
    for part in ONCE:
        if part in options.part:
            measure(part, max(options.spacings))
    write()
    print(page(options, tables))


if __name__ == "__main__":
    main()
