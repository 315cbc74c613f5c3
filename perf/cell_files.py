#!/usr/bin/env python3
"""Which vertices of a run's cells are inside which other cells, by the solid angle under which they see them.

    perf/cell_files.py RUN_DIR [--periods X Y Z]

For each stored time: the cells, and how many vertices of the one are inside the other. --periods: um, of periodic directions (0:
none), whose images count as well. What the studies read of stored surfaces is here, too.
"""
import argparse
import pathlib

import study

study.need("h5py", "numpy")
import h5py
import numpy as np

BLOCK = 2_000_000   # pairs of points and triangles looked at at a time


class Cells:
    """Triangles [n, 3], the cell of each triangle and each vertex, and the vertices [n, 3], um, by time in us."""

    def __init__(self, folder):
        with h5py.File(pathlib.Path(folder) / "cells.h5") as file:
            self.triangles, body = file["triangles"][()], file["body"][()]
            steps = sorted(key for key in file if key.startswith("step_"))
            self.x = {round(float(file[key].attrs["time_us"]), 6): file[key]["x_um"][()] for key in steps}
        self.body = body
        self.of_vertex = np.zeros(self.triangles.max() + 1, int)
        self.of_vertex[self.triangles.ravel()] = np.repeat(body, 3)

    @property
    def last(self):
        return max(self.x)

    def cell(self, number, time):
        """Vertices of one cell, and its triangles among them."""
        chosen = np.flatnonzero(self.of_vertex == number)
        return self.x[time][chosen], self.triangles[self.body == number] - chosen[0]


def nearest_image(d, periods):
    """Differences [n, 3] less the whole periods in them; a period of 0 is none."""
    for axis, period in enumerate(periods):
        if period:
            d[:, axis] -= period * np.round(d[:, axis] / period)
    return d


def vertex_distance(cells, others, time, periods=(0, 0, 0)):
    """Root mean square, um, of how far each vertex is from where it is in another run with the same meshes."""
    d = nearest_image(cells.x[time] - others.x[time], periods)
    return float(np.sqrt((d ** 2).sum(1).mean()))


def travel(cells, time, periods=(0, 0, 0)):
    """Root mean square, um, of how far each vertex has come; less than half a period, as of one that has gone round."""
    d = nearest_image(cells.x[time] - cells.x[min(cells.x)], periods)
    return float(np.sqrt((d ** 2).sum(1).mean()))


def inside(points, x, triangles):
    """Which points are inside a closed surface: its solid angle there (Van Oosterom and Strackee 1983) is 4 pi, not 0."""
    found = np.zeros(len(points), bool)
    for first in range(0, len(points), max(1, BLOCK // len(triangles))):
        some = slice(first, first + max(1, BLOCK // len(triangles)))
        a, b, c = (x[triangles[:, k]][None] - points[some, None] for k in range(3))
        la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
        dot = lambda u, v: np.einsum("pti,pti->pt", u, v)
        over = dot(a, np.cross(b, c))
        under = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb
        found[some] = abs(np.arctan2(over, under).sum(1)) > np.pi   # half of the half solid angle, 2 pi
    return found


def crossed(cells, time, periods=(0, 0, 0)):
    """[(cell, other, how many of its vertices are inside the other)], images beyond periodic sides included."""
    numbers = np.unique(cells.body)
    surfaces = {n: cells.cell(n, time) for n in numbers}
    boxes = {n: (x.min(0), x.max(0)) for n, (x, _) in surfaces.items()}
    shifts = np.array(np.meshgrid(*[(-p, 0, p) if p else (0,) for p in periods])).reshape(3, -1).T
    found = []
    for one in numbers:
        for other in numbers:
            count = 0
            for shift in shifts if one != other else shifts[np.any(shifts != 0, axis=1)]:
                low, high = boxes[other][0] + shift, boxes[other][1] + shift
                near = surfaces[one][0]
                near = near[np.all((near > low) & (near < high), axis=1)]
                if len(near):
                    count += int(inside(near - shift, *surfaces[other]).sum())
            if count:
                found.append((int(one), int(other), count))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run"), parser.add_argument("--periods", type=float, nargs=3, default=(0, 0, 0))
    options = parser.parse_args()
    cells = Cells(options.run)
    print("time_us,cell,other,vertices")
    for time in sorted(cells.x):
        for row in crossed(cells, time, options.periods):
            print(f"{time:g}," + ",".join(map(str, row)))


if __name__ == "__main__":
    main()
