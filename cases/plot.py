#!/usr/bin/env python3
"""Draw what a run has written: python3 cases/plot.py RUN_DIR [--out DIR]

Makes, from what is there,
  outlines.png    outlines of the cells over time: cut by the plane y = const (stretching: z = const) through each
  velocity.png    velocity magnitude on the middle plane at the last stored time
  history.png     histories of every cell or body
  stretching.png  diameters against force, over the experiment
  blood.png       hematocrit and velocity across the flow with their errors, and what was sampled over time
Needs h5py, numpy and matplotlib, in this Python or in another one of this machine; no display.
"""

import argparse
import csv
import json
import pathlib
import sys

import python_with

python_with.need("h5py", "matplotlib", "numpy")
import h5py
import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize


def fail(message):
    """One line, and the exit code of input that is wrong."""
    print(f"plot.py: {message}", file=sys.stderr)
    sys.exit(2)


def open_series(path, name):
    """An HDF5 series and its (time, group) pairs in order of time, or None where the run has none."""
    file = path / name
    if not file.exists():
        print(f"plot.py: no {name} in {path}: left out")
        return None, []
    try:
        data = h5py.File(file, "r")
    except OSError as error:
        print(f"plot.py: {file} cannot be read ({error}): left out")
        return None, []
    times = []
    for key in data:
        if not key.startswith("step_"):
            continue
        try:
            times.append((float(data[key].attrs["time_us"]), key))
        except (KeyError, OSError):
            link = data.get(key, getlink=True)
            fail(f"{file}: {key} leads to {getattr(link, 'filename', key)}, which is missing or damaged: copy the folder as a whole")
    times.sort()
    if not times:
        print(f"plot.py: {name} holds no stored time: left out")
    return data, times


def cut(points, triangles, origin, normal):
    """Segments [n, 2, 3] in which a triangulated surface meets a plane."""
    height = (points - origin) @ normal
    # A vertex on the plane belongs to the positive side, so that each triangle is cut twice or not at all.
    above = height >= 0
    crossed = triangles[above[triangles].any(axis=1) & ~above[triangles].all(axis=1)]
    segments = []
    for triangle in crossed:
        ends = []
        for a, b in ((0, 1), (1, 2), (2, 0)):
            i, j = triangle[a], triangle[b]
            if above[i] != above[j]:
                t = height[i] / (height[i] - height[j])
                ends.append(points[i] + t * (points[j] - points[i]))
        segments.append(ends)
    return np.array(segments).reshape(-1, 2, 3)


def plot_outlines(cells, times, out, stretching):
    """Cuts of all surfaces at up to 12 stored times: at z = const for a stretched cell, at y = const for others."""
    triangles, body = cells["triangles"][()], cells["body"][()]
    axes, normal = ((0, 1), np.array([0.0, 0, 1])) if stretching else ((2, 0), np.array([0.0, 1, 0]))
    chosen = [times[k] for k in np.unique(np.linspace(0, len(times) - 1, 12).astype(int))]
    last = max(times[-1][0], 1e-300)
    colours = ScalarMappable(Normalize(0, last), "viridis")
    figure, axis = plt.subplots(figsize=(9, 5), layout="constrained")
    for time, key in chosen:
        points = cells[key]["x_um"][()]
        for number in np.unique(body):
            mine = triangles[body == number]
            centre = points[np.unique(mine)].mean(axis=0)
            for segment in cut(points, mine, centre, normal):
                axis.plot(segment[:, axes[0]], segment[:, axes[1]], color=colours.to_rgba(time), linewidth=1)
    axis.set_aspect("equal")
    axis.set_xlabel("xyz"[axes[0]] + ", um")
    axis.set_ylabel("xyz"[axes[1]] + ", um")
    figure.colorbar(colours, ax=axis, label="force, pN" if stretching else "time, us", shrink=0.7)
    save(figure, out / "outlines.png")


def middle_plane(nodes, velocity, kind):
    """The middle plane y = const of the grid, or x = const where that one shows more: node positions, speed, normal."""
    best = None
    for grid_axis, normal in ((1, 1), (2, 0)):
        middle = velocity.shape[grid_axis] // 2
        take = [slice(None)] * 3
        take[grid_axis] = middle
        after = list(take)
        after[grid_axis] = middle + 1
        plane = 0.5 * (nodes[tuple(take)] + nodes[tuple(after)])
        speed = np.linalg.norm(velocity[tuple(take)], axis=-1) * 1e3  # um/us to mm/s
        if kind is not None:
            speed = np.ma.masked_where(kind[tuple(take)] == 2, speed)  # inside a body
        flat = np.ptp(plane[..., normal]) < 1e-3 * np.ptp(plane[..., 2])
        if best is None or (flat and np.ptp(speed) > 1.1 * np.ptp(best[1])):
            best = plane, speed, normal
    return best


def plot_velocity(fields, times, cells, cell_times, out):
    """Speed on the middle plane of the grid at the last stored time, with the outlines of the surfaces."""
    time, key = times[-1]
    names = [name for name in fields[key] if name.startswith("velocity")]
    if not names:
        print("plot.py: fields.h5 holds no velocity: left out")
        return
    kind = fields[key]["kind"][()] if "kind" in fields[key] else None
    plane, speed, normal = middle_plane(fields["nodes_um"][()], fields[key][names[0]][()], kind)
    across = 0 if normal == 1 else 1
    figure, axis = plt.subplots(figsize=(10, 4), layout="constrained")
    axis.set_facecolor("0.6")
    mesh = axis.pcolormesh(plane[..., 2], plane[..., across], speed, shading="flat", cmap="magma")
    same = [k for t, k in cell_times if abs(t - time) <= 1e-9 * max(1.0, time)]
    if same:
        points = cells[same[0]]["x_um"][()]
        origin, direction = np.zeros(3), np.zeros(3)
        origin[normal], direction[normal] = plane[..., normal].mean(), 1
        for segment in cut(points, cells["triangles"][()], origin, direction):
            axis.plot(segment[:, 2], segment[:, across], color="white", linewidth=1.2)
    axis.set_aspect("equal")
    axis.set_xlabel("z, um")
    axis.set_ylabel("xyz"[across] + ", um")
    axis.set_title(f"{time:g} us")
    figure.colorbar(mesh, ax=axis, label="speed, mm/s", shrink=0.8)
    save(figure, out / "velocity.png")


def read_table(file):
    """Columns of a CSV file as arrays, empty fields as NaN; None where it holds no line but its names."""
    try:
        with open(file, newline="") as lines:
            rows = list(csv.reader(lines))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        fail(f"{file}: cannot be read as text: {error}")
    if len(rows) < 2:
        print(f"plot.py: {file.name} holds no sample: left out")
        return None
    if "time_us" not in rows[0]:
        fail(f"{file}: its first line is not that of a table of samples: it names no time_us")
    values = []
    for number, row in enumerate(rows[1:], 2):
        if len(row) != len(rows[0]):  # cut off by a kill
            continue
        try:
            values.append([float(v) if v else np.nan for v in row])
        except ValueError as error:
            fail(f"{file}, line {number}: {error}")
    values = np.array(values).reshape(-1, len(rows[0]))
    return {name: values[:, c] for c, name in enumerate(rows[0])}


def read_history(path):
    """Columns of history.csv; None where there is none."""
    file = path / "history.csv"
    if not file.exists():
        print(f"plot.py: no history.csv in {path}: left out")
        return None
    history = read_table(file)
    if history is not None and "cell" not in history:
        fail(f"{file}: its first line is not that of a history: it names no cell")
    return history


def draw_course(axis, times, values, name):
    """A line over time, broken where an angle comes back at the other end of its range."""
    if name.endswith("_deg") and len(values) > 1:
        turns = np.flatnonzero(np.abs(np.diff(values)) > 90) + 1
        times, values = np.insert(times, turns, np.nan), np.insert(values, turns, np.nan)
    axis.plot(times, values, linewidth=1)


def level(axis):
    """What next to nothing changes is drawn level: its digits would fill the panel."""
    values = np.concatenate([line.get_ydata() for line in axis.lines])
    values = values[np.isfinite(values)]
    size = np.abs(values).max(initial=0)
    if values.size and np.ptp(values) < 1e-5 * size:
        axis.set_ylim(values.min() - 0.1 * size, values.max() + 0.1 * size)
    axis.ticklabel_format(useOffset=False)


def plot_history(history, out):
    """One panel for each column that has values and changes with time, one line for each cell."""
    numbers = np.unique(history["cell"][~np.isnan(history["cell"])])
    names = [n for n, v in history.items() if n not in ("time_us", "cell") and not np.isnan(v).all()]
    if not names or np.unique(history["time_us"]).size < 2:
        print("plot.py: history.csv has nothing that changes with time: history.png left out")
        return
    rows = (len(names) + 2) // 3
    figure, axes = plt.subplots(rows, 3, figsize=(13, 2.4 * rows), layout="constrained", squeeze=False, sharex=True)
    for axis, name in zip(axes.flat, names):
        for number in numbers if numbers.size else [np.nan]:
            mine = np.isnan(history["cell"]) if np.isnan(number) else history["cell"] == number
            draw_course(axis, history["time_us"][mine], history[name][mine], name)
        axis.set_title(name, fontsize=9)
        level(axis)
    for axis in axes.flat[len(names) :]:
        axis.set_visible(False)
    figure.supxlabel("time, us")
    save(figure, out / "history.png")


def plot_stretching(history, experiment, out):
    """Axial and transverse diameter against force, over the measurement and its error bars."""
    figure, axis = plt.subplots(figsize=(6.5, 4.5), layout="constrained")
    if experiment and experiment.exists():
        with open(experiment, newline="") as lines:
            rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
        data = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
        for name in ("axial", "transverse"):
            middle = data[f"{name}_um"]
            bars = np.abs([middle - data[f"{name}_lo_um"], data[f"{name}_hi_um"] - middle])
            axis.errorbar(data["force_pN"], middle, bars, fmt="o", color="0.5", capsize=2, markersize=4,
                          label="experiment" if name == "axial" else None)
    else:
        print("plot.py: the run names no experiment that can be read: its points are left out")
    for name, colour in (("axial", "C0"), ("transverse", "C1")):
        axis.plot(history["force_pN"], history[f"{name}_um"], ".-", color=colour, label=f"{name} diameter")
    axis.set_xlabel("force, pN")
    axis.set_ylabel("diameter, um")
    axis.legend()
    save(figure, out / "stretching.png")


def plot_blood(path, out):
    """Profiles of blood.h5 with bars of one standard error, and the columns of blood.csv over time."""
    profile = None
    if (path / "blood.h5").exists():
        with h5py.File(path / "blood.h5", "r") as data:
            across = data.attrs["across"]
            across = across.decode() if isinstance(across, bytes) else str(across)
            profile = {name: values[()] for name, values in data["profile"].items()}
    else:
        print(f"plot.py: no blood.h5 in {path}: profiles left out")
    samples = read_table(path / "blood.csv")
    names = [n for n, v in samples.items() if n != "time_us" and not np.isnan(v).all()] if samples else []
    panels = (2 if profile else 0) + len(names)
    if not panels:
        print("plot.py: nothing was sampled of blood: blood.png left out")
        return
    rows = (panels + 2) // 3
    figure, axes = plt.subplots(rows, 3, figsize=(13, 3 * rows), layout="constrained", squeeze=False)
    left = iter(axes.flat)
    if profile:
        edges = profile["edge_um"]
        middle = 0.5 * (edges[1:] + edges[:-1])
        for name, unit, places in (("hematocrit", "", middle), ("velocity", "_mm_per_s", profile["velocity_um"])):
            axis = next(left)
            bars = np.nan_to_num(profile[f"{name}_error{unit}"])  # where it is not known, none
            axis.errorbar(places, profile[name + unit], bars, fmt="o-", capsize=2, markersize=3)
            axis.set_xlim(edges[0], edges[-1])
            axis.set_ylim(bottom=min(0, np.nanmin(profile[name + unit])))
            axis.set_xlabel(across + ", um")
            axis.set_title(name + (", mm/s" if unit else ""), fontsize=9)
    for name in names:
        axis = next(left)
        draw_course(axis, samples["time_us"], samples[name], name)
        axis.set_xlabel("time, us")
        axis.set_title(name, fontsize=9)
        level(axis)
    for axis in left:
        axis.set_visible(False)
    save(figure, out / "blood.png")


def experiment_of(path):
    """The experiment that the run was compared with, from the case stored in its report."""
    report = path / "report.json"
    if not report.exists():
        return None
    for line in json.loads(report.read_text()).get("resolved_case", "").splitlines():
        if line.startswith("experiment = "):
            return pathlib.Path(json.loads(line.split("=", 1)[1]))
    return None


def save(figure, path):
    try:
        figure.savefig(path, dpi=150)
    except OSError as error:
        fail(f"{path}: cannot be written ({error.strerror}): choose another folder with --out")
    plt.close(figure)
    print(path)


def main():
    parser = argparse.ArgumentParser(description="Draw what a run has written.")
    parser.add_argument("run", type=pathlib.Path, help="folder with the results of a run")
    parser.add_argument("--out", type=pathlib.Path, help="folder for the pictures (default: the run's)")
    arguments = parser.parse_args()
    path = arguments.run
    out = arguments.out or path
    if not path.is_dir():
        fail(f"there is no folder {path}")
    if not any((path / name).exists() for name in ("history.csv", "fields.h5", "cells.h5")):
        fail(f"{path} holds no results: no history.csv, fields.h5 or cells.h5")
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        fail(f"--out {out}: cannot be made a folder ({error.strerror})")
    try:
        draw(path, out)
    except (KeyError, OSError, TypeError, ValueError) as error:
        fail(f"{path}: what it holds is not what a run writes, or is damaged ({type(error).__name__}: {error})")


def draw(path, out):
    """Every picture for which there is something."""
    history = read_history(path)
    stretching = history is not None and "force_pN" in history
    cells, cell_times = open_series(path, "cells.h5")
    fields, field_times = (None, []) if stretching else open_series(path, "fields.h5")
    if cell_times:
        plot_outlines(cells, cell_times, out, stretching)
    if field_times:
        plot_velocity(fields, field_times, cells, cell_times, out)
    if stretching:
        plot_stretching(history, experiment_of(path), out)
    elif history is not None:
        plot_history(history, out)
    if (path / "blood.csv").exists():
        plot_blood(path, out)


if __name__ == "__main__":
    main()
