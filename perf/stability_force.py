"""The rows of perf/stability whose membranes are forces: scenes, what varies, and what makes a run wrong there."""
import math

import cell_files
import force_scenes
from stability_runs import STEP, Series, Setup, half_step, with_values

RATE = 1000.0               # 1/s, of the scenes in shear unless it varies
MOST_IMBALANCE = 0.3        # of energy, above which a run must have said so
WORTH_fJ = 4e-4             # fJ: less work than that is thermal noise


# Scenes.

def scene(scale, title, size, cells, shear=0.0, end=None, **values):
    """Overrides with dots written as __."""
    text = force_scenes.box(title, size, scale.force_spacing_um, cells, shear, end or scale.force_end_us)
    periods = force_scenes.periods(size, shear)
    fastest = 1e-3 * shear * size[1] if shear > 0 else None
    overrides = {STEP: 10} | {key.replace("__", "."): value for key, value in values.items()}
    return Setup(text, overrides, checks=(told(periods), speeds(fastest)), periods=periods)


def sheared(scale, rate=RATE, **values):
    """One red cell between walls."""
    return scene(scale, "A red cell in shear", (12, 12, 9), force_scenes.one_aslant(scale.force_vertices), rate, **values)


def pressed(scale, gap_um, push_nN, **values):
    cells = force_scenes.two_face_to_face(scale.force_vertices, gap_um, push_nN)
    return scene(scale, "Two cells pressed face to face", (12, 12, 12), cells, **values)


def pack(scale, hematocrit, **values):
    """Many, between walls that slide past each other; without slip, with which dense blood crumples in the end."""
    cells = force_scenes.population(scale.force_vertices, hematocrit)
    return scene(scale, "A pack of cells in shear", (12, 12, 12), cells, 500, **({"coupling__slip": False} | values))


# What makes a run wrong.

def told(periods):
    """A vertex that is inside a cell must not be there at a time that is stored: the program undoes that, or stops. Work that
    is not accounted for must have been told, and so must cells that are no longer there."""
    def check(run):
        cells = cell_files.Cells(run.folder)
        if any(len(x) != len(cells.x[0]) for x in cells.x.values()):
            return "cells were lost"
        found = cell_files.crossed(cells, cells.last, periods)
        if found:
            return "crossed at the end: " + ", ".join(f"{n} vertices of cell {a} in cell {b}" for a, b, n in found)
        warned = {entry["figure"] for entry in run.report["warnings"]}
        share = imbalance(run.report["energy_fJ"])
        if share > MOST_IMBALANCE and not warned & {"energy_balance", "energy_balance_coupling"}:
            return f"done with {share:.2g} of the work not accounted for, which was not told"
        if run.report["errors"]["crossings"] != run.report["contact"]["crossings"]:
            return "crossings are counted twice over"
        return None
    return check


def imbalance(energy):
    """What is left over of the work, over the largest term."""
    into = [energy.get(k) or 0 for k in ("boundaries", "pressure_gradient", "pushed")]
    out = [energy.get(k) or 0 for k in ("dissipation", "kinetic", "elastic", "contact", "membrane_dissipation", "membrane_kinetic")]
    largest = max(abs(v) for v in into + out)
    return 0 if largest < WORTH_fJ else abs(sum(into) - sum(out)) / largest


def speeds(fastest_mm_per_s):
    def check(run):
        if fastest_mm_per_s is None or "velocity_x_mm_per_s" not in run.history[-1]:
            return None
        last = run.history[-1]
        speed = math.hypot(*(last[f"velocity_{d}_mm_per_s"] for d in "xyz"))
        return f"done with a cell at {speed:.3g} mm/s between walls of {fastest_mm_per_s / 2:.3g}" if speed > fastest_mm_per_s else None
    return check


# What a run is judged by.

def vertices(reference, factor=1.0):
    """Judge by where the vertices are in the run `reference(setup)`, which has the same meshes."""
    def judge(study, setup, run):
        other = study.run(reference(setup))
        if not other.done:
            return None
        mine, its = cell_files.Cells(run.folder), cell_files.Cells(other.folder)
        time = max(set(mine.x) & set(its.x))
        bound = 0.01 + 0.01 * cell_files.travel(mine, time, setup.periods)
        return factor * cell_files.vertex_distance(mine, its, time, setup.periods), bound
    return judge


# The rows.

HALF = "rms distance of vertices to the run with half the step, doubled, um"
STIFF = "membranes without mass take what steps the stiffness of their links and of the slip allows (src/coupling/force_coupling.cpp, " \
        "measure_stability)"
LONG = r"step|too long"
STRAINED = LONG + r"|area|torn|strain|load|cross|tear"


def all_rows(s, base):
    half = vertices(half_step, 2)
    longest = [(base.report["stability"]["largest_stable_step_us"], "program")] if base.done else []

    def row(axis, name, unit, values, setup, cause=STRAINED, **more):
        settings = dict(axis=axis, name="as forces: " + name, unit=unit, values=values, setup=setup, judge=half, quantity=HALF,
                        cause=cause, source=STIFF)
        return Series(**(settings | more))

    def stiffer(factor, dt):
        end = s.force_end_us if dt >= 10 else s.force_end_us * dt / 10
        return sheared(s, end=end, cells__0__shear_modulus_uN_per_m=6.32 * factor, time__step_us=dt)

    def whole(dt):
        return s.force_end_us / round(s.force_end_us / dt)
    slow = {"end": 2 * s.force_end_us}
    of_step = dict(unit="us", judge=vertices(with_values({STEP: 5})), quantity="rms distance of vertices to dt = 5 us, um", cause=LONG)
    one = lambda v, key: sheared(s, **{f"cells__0__{key}": v})
    many = lambda v, key, **more: pack(s, 0.45, **{f"cell_types__0__{key}": v} | more)
    resists = "none above 1; below it what resists a membrane is the mean of both sides'"
    implicit = "none: one implicit solve on the membrane a step"
    ratios, etas = [0.1, 0.5, 1, 2, 5, 20, 50], [0, 1e-9, 1e-8, 1e-7, 5e-7, 1e-6]
    surface = "membrane_viscosity_N_s_per_m"
    return [
        row("viscosity ratio", "viscosity ratio", "", ratios, lambda r: one(r, "viscosity_ratio"), source=resists),
        row("viscosity ratio", "viscosity ratio, hematocrit 0.45", "", [0.1, 2, 5, 20, 50],
            lambda r: many(r, "viscosity_ratio"), cause=STRAINED + "|wall|viscosity",
            source="the pressure of a projection lags behind what a viscosity that varies asks for"),
        row("surface viscosity", "membrane viscosity, ratio 5", "N s/m", etas, cause=STRAINED + "|viscos", source=implicit,
            setup=lambda eta: sheared(s, cells__0__viscosity_ratio=5, cells__0__membrane_viscosity_N_s_per_m=eta)),
        row("surface viscosity", "membrane viscosity, ratio 5, hematocrit 0.45", "N s/m", etas[::3] + etas[-1:],
            lambda eta: many(eta, surface, cell_types__0__viscosity_ratio=5), cause=STRAINED + "|viscos", source=implicit),
        row("hematocrit", "hematocrit at 500 /s, no slip", "", [0.1, 0.2, 0.3, 0.45, 0.6], lambda h: pack(s, h, **slow),
            cause=STRAINED + "|hematocrit", log=False, source="as much as packing places (0.67 in a box)"),
        row("hematocrit", "hematocrit at 500 /s, slip", "", [0.1, 0.3, 0.45], lambda h: pack(s, h, coupling__slip=True, **slow),
            cause=STRAINED + "|hematocrit", log=False, source="with slip dense blood crumples after a strain of some units"),
        row("gap", "gap of two cells pressed with 0.2 nN", "um", [0.01, 0.03, 0.1, 0.25, 0.6, 1.5], lambda g: pressed(s, g, 0.2),
            cause=STRAINED + "|gap|overlap", source="none: below its range contact grows without bound"),
        row("push", "push on two cells 0.3 um apart", "nN", [0.05, 0.2, 0.5, 1, 2, 5, 20], lambda f: pressed(s, 0.3, f),
            cause=STRAINED + "|push", source="none: contact wins over any push; a membrane whose area has changed by a tenth is torn",
            bisect=s.bisect - 2),
        row("shear rate", "shear rate", "1/s", [10, 100, 1000, 3000, 10000, 30000], lambda rate: sheared(s, rate), bisect=s.bisect - 2,
            source="none for the scheme; the membrane's area grows with the load (10 % is torn)"),
        row("force step", "time step, slip", values=[2.5, 5, 10, 20, 50, 100, 200], setup=lambda dt: sheared(s, time__step_us=whole(dt)),
            limits=longest, bisect=s.bisect - 2, **of_step),
        row("force step", "time step, no slip", values=[2.5, 5, 10, 20, 50, 100, 200],
            setup=lambda dt: sheared(s, time__step_us=whole(dt), coupling__slip=False), **of_step),
        row("force step", "time step, hematocrit 0.45, no slip", values=[5, 10, 20, 50, 100],
            setup=lambda dt: pack(s, 0.45, time__step_us=whole(dt)), **of_step),
        row("force modulus", "shear modulus, steps of 10 us", "x 6.32 uN/m", [0.01, 0.1, 1, 10, 100], lambda f: stiffer(f, 10)),
        row("force modulus", "shear modulus, steps of 10 us over it", "x 6.32 uN/m", [1, 10, 100], lambda f: stiffer(f, 10 / f)),
    ]
