"""What perf/stability runs and judges each run by; its docstring says what the outcomes and errors mean."""
import concurrent.futures
import dataclasses
import json
import math
import re
import threading
from typing import Callable

import h5py
import numpy as np

import compare_outlines
import study

STEP, SPEED = "time.step_us", "boundary.0.velocity_mm_per_s"


@dataclasses.dataclass
class Setup:
    """One run: a case file (a name in cases/, or text) and what overrides it."""
    case: str
    overrides: dict
    contraction: float = 1.0    # mean speed where the cell ends over that at the inlet
    checks: tuple = ()          # of membranes that are forces, in place of the speed in a tube: run -> why it is wrong, or None
    periods: tuple = (0, 0, 0)  # um, along x, y and z; 0: none

    def key(self):
        return json.dumps([self.case, self.overrides], sort_keys=True)


@dataclasses.dataclass
class Series:
    """One row of the map."""
    axis: str
    name: str                       # of the row
    unit: str                       # of its values
    values: list
    setup: Callable                 # value -> Setup
    judge: Callable                 # (study, setup, run) -> (error, bound), or None where the reference does not exist
    quantity: str                   # what the error is
    cause: str                      # pattern of the cause that a message must name
    limits: list = dataclasses.field(default_factory=list)   # (value, "program", ...)
    source: str = ""                # formula of the predicted limit, or why there is none
    bisect: int = 0                 # runs spent on each change between stable and not
    log: bool = True
    added_mass: Callable = None     # measured limit -> the c that it implies


class Study:
    """Runs each setup once, however many rows ask for it."""

    def __init__(self, scale, work, limit):
        self.scale, self.work, self.limit, self.memory, self.lock = scale, work, limit, {}, threading.Lock()

    def run(self, setup):
        with self.lock:
            known = self.memory.get(setup.key())
            if known is None:
                future = self.memory[setup.key()] = concurrent.futures.Future()
                number = len(self.memory)
        if known is not None:
            return known.result()
        future.set_result(self.start(setup, self.work / f"{number:03d}"))
        return future.result()

    def start(self, setup, folder):
        if not self.limit.allows():
            return self.limit.no_run(folder)
        allowed = min(self.scale.timeout_s, self.limit.left_s)
        run = study.run(setup.case, setup.overrides, folder, threads=1, timeout_s=allowed)
        # One that ran out of the study's time, not its own, says nothing about the program.
        return self.limit.no_run(folder) if run.code is None and allowed < self.scale.timeout_s else run


@dataclasses.dataclass
class Scale:
    """How large the runs are."""
    nodes: tuple
    vertices: int
    end_us: float
    timeout_s: float
    bisect: int
    most_vertices: int
    force_spacing_um: float     # of the scenes whose membranes are forces
    force_vertices: int
    force_end_us: float


QUICK = Scale((17, 17, 25), 300, 60, 60, 4, 8000, 0.75, 250, 400)
FULL = Scale((31, 31, 51), 500, 400, 3600, 6, 27472, 0.5, 500, 2000)


# What a run is judged by.

def data_sets(group, path=""):
    """Of a file whose entries are links to other files, which visititems() passes by."""
    for name, item in group.items():
        if isinstance(item, h5py.Dataset):
            yield f"{path}{name}", item
        else:
            yield from data_sets(item, f"{path}{name}/")


def not_finite(folder):
    """First data set or column of the output files that is not finite, or None."""
    for name in ("cells.h5", "fields.h5"):
        if not (folder / name).exists():
            continue
        try:
            with h5py.File(folder / name) as file:
                found = [path for path, item in data_sets(file) if item.dtype.kind == "f" and not np.isfinite(item[()]).all()]
        except OSError as error:
            return f"{name} cannot be read ({error})"
        if found:
            return f"{name}: {found[0]}"
    return None


def numbers(tree):
    if isinstance(tree, dict):
        return [n for value in tree.values() for n in numbers(value)]
    return [tree] if isinstance(tree, float) else []


def fault(setup, run):
    """Why a run is wrong whatever its accuracy, or None."""
    if run.code is None:
        return run.message or "time-out"
    if run.code not in (0, 2, 3, 5):
        return f"exit code {run.code}"
    bad = not_finite(run.folder)
    history = run.folder / "history.csv"    # read as text: empty fields are columns that a run does not have
    if history.exists() and re.search(r"\b(nan|inf)", history.read_text(), re.I):
        bad = bad or "history.csv"
    if bad:
        return f"not finite: {bad}"
    if run.code != 0:
        return None
    if not run.report:
        return "done without report.json"
    if not all(math.isfinite(n) for n in numbers(run.report["errors"])):
        return "not finite: report.json"
    if setup.case == "stretch.toml" or not run.history:  # there the volume is held by a penalty
        return None
    for name, bound in (("volume_drift", 1e-3), ("area_drift", 0.1)):
        if run.report["errors"].get(name) is not None and run.report["errors"][name] > bound:
            return f"done with {name} = {run.report['errors'][name]:.2g}"
    if setup.checks:
        return next((wrong for wrong in (check(run) for check in setup.checks) if wrong), None)
    speed, mean = run.history[-1]["velocity_z_mm_per_s"], setup.overrides.get(SPEED, 2) * setup.contraction
    if not -0.1 * mean <= speed <= 3 * mean:
        return f"done with a cell at {speed:.3g} mm/s in a flow of {mean:g} mm/s"
    return None


def told_amiss(setup, run):
    """What a run with membranes as forces has told of itself that makes its figures doubtful, or ""."""
    if not setup.checks:
        return ""
    told = [f"{w['figure']} = {w['value']:.2g}" for w in run.report["warnings"] if w["figure"].startswith(("energy", "crossings"))]
    return "told: " + ", ".join(told) if told else ""


def outline(reference, factor=1.0):
    """Judge by the distance of the surfaces to the run `reference(setup)`."""
    def judge(study, setup, run):
        other = study.run(reference(setup))
        if not other.done:
            return None
        last = max(set(compare_outlines.read(run.folder)[1]) & set(compare_outlines.read(other.folder)[1]))
        both = compare_outlines.compare(run.folder, other.folder, [last], keep_position=True)
        ends = run.history[0], run.history[-1]
        travel = math.dist(*[[row[f"centroid_{d}_um"] for d in "xyz"] for row in ends])
        return factor * both[-1][1], 0.01 + 0.01 * travel
    return judge


def half_step(setup):
    return with_values({STEP: setup.overrides[STEP] / 2})(setup)


def with_values(values):
    return lambda setup: dataclasses.replace(setup, overrides=setup.overrides | values)


def cell_speed(reference):
    def judge(study, setup, run):
        other = study.run(reference(setup))
        if not other.done:
            return None
        mine, its = (r.history[-1]["centroid_z_um"] - r.history[0]["centroid_z_um"] for r in (run, other))
        return abs(mine / its - 1), 0.02
    return judge


def axial_diameter(study, setup, run):
    other = study.run(Setup(setup.case, setup.overrides | {"stretching.steps": 64}))
    if not other.done:
        return None
    return abs(run.history[-1]["axial_um"] - other.history[-1]["axial_um"]), 0.05


def poiseuille(study, setup, run):
    return run.report["errors"]["poiseuille_velocity"], 0.05


def channel_profile(study, setup, run):
    """Largest difference from plane Poiseuille flow, within one height of the middle, over the largest speed."""
    with h5py.File(run.folder / "fields.h5") as file:
        nodes = np.array(file["nodes_um"])
        u = np.array(file[sorted(k for k in file if k.startswith("step_"))[-1]]["velocity_um_per_us"])
    x = sum(nodes[k:k - 1 or None, j:j - 1 or None, i:i - 1 or None] for k in (0, 1) for j in (0, 1) for i in (0, 1)) / 8
    height, middle = nodes[..., 1].max(), 0.5 * (nodes[..., 0].max() + nodes[..., 0].min())
    s = x[..., 1] / height
    exact = np.stack([1.5 * 2e-3 * 4 * s * (1 - s), 0 * s, 0 * s], -1)
    near = abs(x[..., 0] - middle) < max(height, 1.01 * np.diff(nodes[..., 0], axis=2).max())
    return float(np.abs(u - exact)[near].max() / 3e-3), 0.02
