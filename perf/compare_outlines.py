#!/usr/bin/env python3
"""Distance between the surfaces of one cell in two runs, at the times that both stored.

    perf/compare_outlines.py RUN_DIR REFERENCE_DIR [--at US] [--keep-position]

For every vertex of the run's surface: its distance to the nearest point of the reference's triangles, after both
centroids (of the enclosed volume) were put at the origin; the numbers of vertices may differ. Prints, per time: rms and
largest distance in both directions (the larger), and the shift of the centroid, um.
"""
import argparse, pathlib, sys

import study

study.need("h5py", "numpy")
import h5py
import numpy as np


def read(folder):
    file = h5py.File(pathlib.Path(folder) / "cells.h5")
    triangles = next(np.array(v) for v in file.values() if isinstance(v, h5py.Dataset) and v.ndim == 2 and v.shape[1] == 3
                     and v.dtype.kind == "i")
    steps = sorted(k for k in file if k.startswith("step_"))
    return triangles, {round(float(file[k].attrs["time_us"]), 6): np.array(file[k]["x_um"]) for k in steps}


def centroid(x, t):
    a, b, c = x[t[:, 0]], x[t[:, 1]], x[t[:, 2]]
    six = np.einsum("ij,ij->i", a, np.cross(b, c))
    return (six[:, None] * (a + b + c)).sum(0) / (4 * six.sum())


def distances(points, x, t):
    """From each point to the nearest of the triangles (Ericson, Real-Time Collision Detection, section 5.1.5)."""
    a, b, c = x[t[:, 0]], x[t[:, 1]], x[t[:, 2]]
    ab, ac = b - a, c - a
    best = np.empty(len(points))
    for n, p in enumerate(points):
        ap, bp, cp = p - a, p - b, p - c
        d1, d2 = (ab * ap).sum(1), (ac * ap).sum(1)
        d3, d4 = (ab * bp).sum(1), (ac * bp).sum(1)
        d5, d6 = (ab * cp).sum(1), (ac * cp).sum(1)
        va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
        with np.errstate(divide="ignore", invalid="ignore"):
            v, w = vb / (va + vb + vc), vc / (va + vb + vc)
            on_ab, on_ac = d1 / (d1 - d3), d2 / (d2 - d6)
            on_bc = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        rules = [((d1 <= 0) & (d2 <= 0), 0, 0), ((d3 >= 0) & (d4 <= d3), 1, 0), ((d6 >= 0) & (d5 <= d6), 0, 1),
                 ((vc <= 0) & (d1 >= 0) & (d3 <= 0), on_ab, 0), ((vb <= 0) & (d2 >= 0) & (d6 <= 0), 0, on_ac),
                 ((va <= 0) & (d4 >= d3) & (d5 >= d6), 1 - on_bc, on_bc)]
        for where, first, second in reversed(rules):
            v, w = np.where(where, first, v), np.where(where, second, w)
        foot = a + v[:, None] * ab + w[:, None] * ac
        best[n] = np.sqrt(((foot - p) ** 2).sum(1).min())
    return best


def compare(run, reference, times=None, keep_position=False):
    """List of (time, rms, largest, centroid shift)."""
    (t1, runs), (t2, references) = read(run), read(reference)
    rows = []
    for time in sorted(set(runs) & set(references)):
        if times and not any(abs(time - t) < 1e-6 for t in times):
            continue
        x, y = runs[time], references[time]
        cx, cy = centroid(x, t1), centroid(y, t2)
        if not keep_position:
            x, y = x - cx, y - cy
        there, back = distances(x, y, t2), distances(y, x, t1)
        rms = max(np.sqrt((there ** 2).mean()), np.sqrt((back ** 2).mean()))
        rows.append((time, rms, max(there.max(), back.max()), np.linalg.norm(cx - cy)))
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run"), parser.add_argument("reference")
    parser.add_argument("--at", type=float, action="append", help="only this time, us (may be repeated)")
    parser.add_argument("--keep-position", action="store_true", help="do not move the centroids together")
    options = parser.parse_args()
    rows = compare(options.run, options.reference, options.at, options.keep_position)
    if not rows:
        sys.exit("compare_outlines.py: the runs have no time in common (output.every_us)")
    print("time_us,rms_um,largest_um,centroid_shift_um")
    for row in rows:
        print("{:g},{:.5f},{:.5f},{:.5f}".format(*row))


if __name__ == "__main__":
    main()
