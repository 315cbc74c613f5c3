"""What the problems of error_vs_time share: settings, sweeps, running, and what the rows say about orders."""
import dataclasses
import json
import subprocess

import numpy as np

import study

KEYS = {"nodes": "grid.nodes", "step_us": "time.step_us", "first_step_us": "time.first_step_us",
        "vertices": "cells.0.vertices", "spin_deg": "cells.0.spin_deg",
        "cross_section": "grid.cross_section", "convection": "fluid.convection",
        "momentum_tolerance": "fluid.momentum_tolerance", "divergence_tolerance": "fluid.divergence_tolerance",
        "scheme": "coupling.scheme", "coupling_tolerance": "coupling.tolerance",
        "robin_coefficient": "coupling.robin_coefficient_pg_per_um2_per_us", "force_steps": "stretching.steps",
        "rest_tolerance": "stretching.tolerance", "body_vertices": "bodies.0.vertices",
        "kernel": "coupling.kernel", "slip": "coupling.slip", "pressure": "coupling.pressure",
        "contact_range_um": "contact.range_um", "viscosity_ratio": "cells.0.viscosity_ratio"}


def overrides(settings):
    """A value that stands for the program's own choice is a text with a blank, and not passed on."""
    chosen = {KEYS[k]: v for k, v in settings.items() if k in KEYS and " " not in str(v)}
    if "grid.nodes" in chosen:
        chosen["grid.nodes"] = [int(n) for n in settings["nodes"].split("x")]
    return chosen


def percent(value, exact):
    return 100 * abs(value / exact - 1)


@dataclasses.dataclass
class Plan:
    settings: dict
    varied: str        # the key that differs from the default, "default", "several" or "reference"
    place: int = 0     # in its sweep, coarse to fine; the default has its own place in each


class Problem:
    """Sweeps list values from coarse to fine with the default among them; a value may be a dictionary of several keys."""
    name = title = what = ""
    errors = {}      # column of the table: label; the error of a run against the reference or the exact answer
    default = {}

    def __init__(self, full):
        self.full = full
        self.notes = []   # sentences for the page
        self.floors = {}  # error column: uncertainty of the reference itself

    def sweeps(self):
        return {}

    def combinations(self):
        return []

    def references(self):
        return []

    def plan(self, cores):
        plans = [Plan(self.default, "default")]
        sweeps = self.sweeps()
        if cores > 1 and "threads" in self.default:
            sweeps |= {"threads": [1, cores], "ranks": [1, cores]}
        for key, values in sweeps.items():
            for place, value in enumerate(values):
                settings = self.default | (value if isinstance(value, dict) else {key: value})
                if settings != self.default:
                    plans.append(Plan(settings, key, place))
        plans += [Plan(self.default | values, "several") for values in self.combinations()]
        return plans + [Plan(self.default | values, "reference") for values in self.references()]

    def default_place(self, key):
        values = self.sweeps().get(key, [])
        merged = [self.default | (v if isinstance(v, dict) else {key: v}) for v in values]
        return merged.index(self.default) if self.default in merged else -1

    def simulate(self, settings, folder, timeout_s):
        raise NotImplementedError

    def measure(self, settings, folder, timeout_s):
        """One row: settings, times and what can be said without the other runs; "_" columns are for finish() alone."""
        outcome = self.simulate(settings, folder, timeout_s)
        row = {"problem": self.name, **settings, "code": outcome.code, "message": outcome.message, "_run": outcome}
        if outcome.done:
            row["wall_s"] = outcome.report["wall_s"]
            row |= {f"wall_s_{k.replace(' ', '_')}": v for k, v in outcome.report["wall_s_by_part"].items()}
            row |= self.quantities(settings, outcome)
        return row

    def quantities(self, settings, outcome):
        return {}

    def finish(self, rows):
        """Errors against a reference among the rows, and notes."""


class ExternalProblem(Problem):
    """A small program of its own that prints one JSON line; the case file cannot express the problem."""
    program = ""

    def arguments(self, settings):
        return []

    def simulate(self, settings, folder, timeout_s):
        command = [str(study.study_program(self.program)), *(str(a) for a in self.arguments(settings))]
        try:
            result = subprocess.run(command, capture_output=True, text=True, timeout=timeout_s)
        except subprocess.TimeoutExpired:
            return study.Run(None, timeout_s, {}, [], f"stopped after {timeout_s} s", folder)
        lines = [line for line in result.stdout.splitlines() if line.startswith("{")]
        report = {"wall_s_by_part": {}, **json.loads(lines[-1])} if result.returncode == 0 and lines else {}
        code = result.returncode if report or result.returncode else -1
        return study.Run(code, report.get("wall_s", 0), report, [], (result.stderr or result.stdout)[-200:], folder)


def compare_alone(problem, rows, difference):
    """Each run of a sweep against the finest run of that sweep: what this one setting leaves, the others being equal."""
    default = next((r for r in rows if r["varied"] == "default"), None)
    for key in problem.sweeps():
        members = [(r["place"], r) for r in rows if r["varied"] == key]
        if not members or not default:
            continue
        finest = max(members + [(problem.default_place(key), default)], key=lambda m: m[0])[1]
        for _, row in members:
            if row is not finest:
                row |= difference(row, finest)
        if finest is not default:
            default[f"_alone_{key}"] = difference(default, finest)
    for key, values in {k[7:]: v for k, v in (default or {}).items() if k.startswith("_alone_")}.items():
        problem.notes.append(f"Refining `{key}` alone moves the default by " + ", ".join(
            f"{v:.2g} % ({name.replace('_alone_pc', '').replace('alone_pc', 'diameters')})" for name, v in values.items()) + ".")


def richardson(resolution, value):
    """(limit, order) from the three finest of values at rising resolution; None unless they approach it steadily."""
    n, f = np.array(resolution[-3:], float), np.array(value[-3:], float)
    if len(n) < 3 or (f[2] - f[1]) * (f[1] - f[0]) <= 0:
        return None
    h, ratio = 1 / n, (f[1] - f[0]) / (f[2] - f[1])
    of = lambda p: (h[1] ** p - h[0] ** p) / (h[2] ** p - h[1] ** p) - ratio
    low, high = 0.5, 4.5
    if of(low) * of(high) > 0:
        return None
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if of(low) * of(middle) > 0 else (low, middle)
    return f[2] + (f[2] - f[1]) * h[2] ** low / (h[1] ** low - h[2] ** low), low


def note_orders(problem, rows, key, resolution, quantities):
    """Notes the order in `key`; returns how far (per cent) the first quantity's finest value may be from its limit."""
    chosen = sorted(((resolution(r[key]), r) for r in rows if r["code"] == 0 and r["varied"] in (key, "default")),
                    key=lambda entry: entry[0])
    if len(chosen) < 3:
        return None
    left, texts = None, []
    for column, label in quantities.items():
        n, values = [c[0] for c in chosen], [c[1][column] for c in chosen]
        found = richardson(n, values)
        texts.append(f"{label}: order {found[1]:.1f}, limit {found[0]:.4g} (finest {values[-1]:.4g})" if found else
                     f"{label}: no clean order ({', '.join(f'{v:.4g}' for v in values[-3:])})")
        if left is None:
            left = percent(values[-1], found[0]) if found else percent(values[-2], values[-1])
    problem.notes.append(f"Richardson in `{key}` (three finest, others at default): " + "; ".join(texts) + ".")
    return left
