#!/usr/bin/env python3
"""Nodes of a periodic channel that narrows to half its width in its middle, for grid.generator = "file": narrowing.py FILE.h5

The data set "nodes" has the shape [nk, nj, ni, 3]: corners of the cells, x, y, z in um, i fastest; i, j, k are right-handed.
"""
import sys

import python_with

python_with.need("h5py", "numpy")
import h5py
import numpy as np


def nodes(width=10.0, length=24.0, across=17, along=33):
    side = np.linspace(-0.5, 0.5, across)
    z = np.linspace(-length / 2, length / 2, along)
    wide = width * (0.75 - 0.25 * np.cos(2 * np.pi * z / length))
    k, j, i = np.meshgrid(np.arange(along), np.arange(across), np.arange(across), indexing="ij")
    return np.stack([wide[k] * side[i], wide[k] * side[j], z[k]], axis=-1)


if len(sys.argv) != 2:
    sys.exit(__doc__)
with h5py.File(sys.argv[1], "w") as file:
    file["nodes"] = nodes()
