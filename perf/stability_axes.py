"""The rows of perf/stability: cases, what varies, and the limit that theory predicts (formulas in its docstring)."""
import math
import re

import h5py
import numpy as np

import stability_force
import study
from stability_runs import (SPEED, STEP, Series, Setup, axial_diameter, cell_speed, channel_profile, half_step, outline,
                            poiseuille, with_values)

AREA = 132.0                        # um2 of the triangulated cell
THICKNESS = 2.55                    # um, of the resting cell's rim
GROWING = {STEP: 4, "time.first_step_us": 1}
ADDED_MASS = {"added mass, free fluid": 1.19, "added mass, 10 um tube": 2.4}   # um, c of the docstring
MU, RHO, NU = 1.1, 1.0, 1.1         # mPa s, pg/um3, um2/us


# Cases.

def tube(scale, **values):
    """cases/straight_tube.toml, smaller; overrides with dots written as __."""
    overrides = {"grid.nodes": list(scale.nodes), "cells.0.vertices": scale.vertices, STEP: 1, "time.first_step_us": 0,
                 "time.end_us": scale.end_us,
                 "output.history_every_us": 0, "output.checkpoint_every_us": 0}
    overrides |= {key.replace("__", "."): value for key, value in values.items()}
    overrides["output.every_us"] = overrides["time.end_us"]
    return Setup("straight_tube.toml", overrides)


CHANNEL = """title = "Plane channel on a grid from a file"
[time]
step_us = 10
end_us = 100
[grid]
generator = "file"
file = "{file}"
[fluid]
convection = {convection}
[output]
checkpoint_every_us = 0
""" + "".join(f'[[boundary]]\nside = "{side}"\ntype = {rest}\n' for side, rest in (
    ("i_min", '"velocity_inlet"\nvelocity_mm_per_s = [2, 0, 0]'), ("i_max", '"outflow"'), ("j_min", '"wall"'),
    ("j_max", '"wall"'), ("k_min", '"periodic"'), ("k_max", '"periodic"')))


def channel(folder, name, convection="true", skew_deg=0.0, aspect=1.0, jump=1.0, alternating=False):
    """A channel 10 um high, 16 cells across. Grid lines across it follow x + tan(skew) H / 2 pi sin(2 pi y / H): their
    angle to the normal rises to skew_deg and every cell keeps its volume. Spacing along is 1.6 `aspect` times that across;
    that across jumps by `jump` in the middle, or from every cell to the next."""
    height, cells = 10.0, 16
    dy = np.where(np.arange(cells) % 2 if alternating else np.arange(cells) < cells // 2, 1.0, jump)
    y = np.concatenate([[0], np.cumsum(dy)]) * height / dy.sum()
    x, z = np.linspace(0, 40 * aspect * height / cells * 1.6, 41), np.linspace(0, 2.5, 5)
    zz, yy, xx = np.meshgrid(z, y, x, indexing="ij")
    xx = xx + math.tan(math.radians(skew_deg)) * height / (2 * math.pi) * np.sin(2 * math.pi * yy / height)
    path = folder / f"{name}.h5"
    with h5py.File(path, "w") as file:
        file["nodes"] = np.stack([xx, yy, zz], -1)
    return Setup(CHANNEL.format(file=path, convection=convection), {})


def narrowing(folder, scale, nodes, throat, vertices):
    """The tube's own nodes, drawn in to a throat of `throat` um between z = 1 and 7 um, and a cell carried into it."""
    nodes, s = nodes.copy(), np.clip((nodes[..., 2] - 1) / 6, 0, 1)
    nodes[..., :2] *= (1 + (throat / 10 - 1) * s ** 2 * (3 - 2 * s))[..., None]
    path = folder / f"throat_{throat:g}.h5"
    with h5py.File(path, "w") as file:
        file["nodes"] = nodes
    text = (study.ROOT / "cases/straight_tube.toml").read_text()
    text = re.sub(r"\[grid\].*?(?=\[fluid\])", f'[grid]\ngenerator = "file"\nfile = "{path}"\n\n', text, flags=re.S)
    values = tube(scale).overrides | {"cells.0.vertices": vertices, "time.end_us": 3000, "output.every_us": 3000} | GROWING
    return Setup(text, {key: value for key, value in values.items() if not key.startswith("grid.")}, (10 / throat) ** 2)


def two_cells(scale, distance):
    """The tube with a second cell behind the first, centres `distance` um apart."""
    text = (study.ROOT / "cases/straight_tube.toml").read_text()
    text += f"\n[[cells]]\ncenter_um = [0, 0, {-distance}]\nvertices = {scale.vertices}\n"
    return Setup(text, tube(scale).overrides)


# Predicted limits.

def implied_added_mass(mass, dt, nu, h, robin=True):
    """c for which M / (A dt) + beta = 3/4 rho c / dt."""
    beta = math.pi * RHO * nu / h if robin else 0.0
    return (mass / (AREA * dt) + beta) * dt / (0.75 * RHO)


def added_mass_limits(solve):
    """The predicted limits, where `solve(c)` is positive."""
    return [(solve(c), name) for name, c in ADDED_MASS.items() if solve(c) > 0]


def amplification(courant, diffusion):
    """Largest growth per step of any Fourier mode: 3/2 g^2 - 2 g + 1/2 + (2 g - 1) i a + g^2 d = 0."""
    theta = np.linspace(1e-3, math.pi, 181)
    a, d = courant * np.sin(theta), diffusion * (2 - 2 * np.cos(theta))
    first, second, third = 1.5 + d, -2 + 2j * a, 0.5 - 1j * a
    root = np.sqrt(second ** 2 - 4 * first * third)
    return max(abs((-second + sign * root) / (2 * first)).max() for sign in (1, -1))


def largest_courant(cell_reynolds):
    """Largest stable U dt / h at a given U h / nu, by bisection. Growth below 1 % a step is left to the flow's shear."""
    low, high = 1e-3, 1e3
    for _ in range(40):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if amplification(middle, middle / cell_reynolds) < 1.01 else (low, middle)
    return low


# The rows.

ADDED = "M / (A dt) + beta > max(2 mu / h, 3/4 rho c / dt)"
GROWS = "none: the default beta grows with the fluid's added mass over the step; " + ADDED
HALF = "rms distance to the run with half the step, doubled, um"
UNSTABLE = r"coupling|Robin|light"


def coupling_rows(s, threshold):
    half, h = outline(half_step, 2), 2 * MU / threshold
    masses = [1, 27, 100, 1000, 7200]

    def row(name, values, change, **more):
        settings = dict(axis="mass", name=name, unit="pg", values=values, judge=half, quantity=HALF, cause=UNSTABLE,
                        setup=lambda m: tube(s, cells__0__mass_pg=m, **change), source=ADDED)
        return Series(**(settings | more))
    short = {"time__step_us": 0.1, "time__end_us": 10, "boundary__0__ramp_us": 0}
    few = {"coupling__scheme": "iterated", "time__end_us": 5}
    bare = few | {"coupling__robin_in_iterated": False, "time__end_us": 3}
    light = dict(limits=added_mass_limits(lambda c: AREA * (0.75 * RHO * c - 0.1 * math.pi * MU / h)),
                 added_mass=lambda mass: implied_added_mass(mass, 0.1, NU, h))
    return [
        row("mass, robin, dt 1 us", masses, {}, source=ADDED + ": holds at any mass"),
        row("mass, robin, dt 0.1 us", masses, short, source=GROWS),
        row("mass, robin with beta = pi mu / h, dt 0.1 us", masses,
            short | {"coupling__robin_coefficient_pg_per_um2_per_us": round(math.pi * MU / h, 4)}, **light,
            bisect=s.bisect),
        row("mass, loose, dt 1 us", [27, 100, 600, 700, 1000, 7200], {"coupling__scheme": "loose"}, bisect=s.bisect - 2,
            limits=[(AREA * threshold, "program")],
            source=ADDED + "; below it the program refuses, so the true limit can only be shown not to lie above"),
        row("mass, iterated, dt 1 us", masses, few, source=ADDED + ": holds at any mass"),
        row("mass, iterated, dt 0.1 us", masses, short | {"coupling__scheme": "iterated", "time__end_us": 1}, **light,
            bisect=s.bisect - 1, source="abs(beta - Lambda) < M / (A dt) + beta, which is the same inequality"),
        row("mass, iterated without Robin, dt 1 us", masses[2:], bare, bisect=s.bisect - 2,
            source="Aitken relaxes: factor about 1 - omega (1 + Lambda A dt / M); no fixed limit, but 200 iterations"),
    ]


def step_rows(s, threshold):
    def setup(dt, ramp_us):
        end = 100 if dt >= 0.5 else 20 if dt >= 0.2 else 5
        return tube(s, time__step_us=end / round(end / dt), time__end_us=end, boundary__0__ramp_us=ramp_us)
    rows = [Series(
        axis="step", name=f"time step, 100 pg, {name}", unit="us", values=values, bisect=bisect, cause=UNSTABLE,
        setup=lambda dt, ramp=ramp: setup(dt, ramp), judge=outline(with_values({STEP: 0.5})),
        quantity="rms distance to dt = 0.5 us, um",
        source=GROWS + "; no longest step, since viscous terms are implicit")
        for name, ramp, values, bisect in (("ramp 20 us", 20, [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50], s.bisect),
                                           ("impulsive", 0, [0.05, 0.1, 0.2, 1, 10, 50], 0))]
    return rows + [Series(
        axis="step", name="time step, 100 pg, first steps 1 us", unit="us", values=[4, 10, 20, 50], cause=UNSTABLE,
        setup=lambda dt: tube(s, time__step_us=dt, time__first_step_us=1, time__end_us=200),
        judge=outline(with_values({STEP: 0.5})), quantity="rms distance to dt = 0.5 us, um",
        source="none: a step of a 25th of the time since the start at most (src/coupling/step_schedule.hpp)")]


def membrane_rows(s):
    half = outline(half_step, 2)

    def row(name, key, base, unit, values, source, cause="membrane|stiff|viscos"):
        return Series(axis=name, name=name, unit=unit, values=values, judge=half, quantity=HALF, cause=cause, source=source,
                      setup=lambda v: tube(s, **{f"cells__0__{key}": v * base}))
    substeps = "none: the membrane takes 0.3 of its stable step 2 / omega_max, sub-cycled (src/membrane/membranes.cpp)"
    rows = [
        row("shear modulus", "shear_modulus_uN_per_m", 6.32, "x 6.32 uN/m", [0.01, 0.1, 1, 10, 100, 1000], substeps),
        row("bending modulus", "bending_modulus_J", 2.4e-19, "x 2.4e-19 J", [0.01, 0.1, 1, 10, 100], substeps),
        row("membrane viscosity", "membrane_viscosity_N_s_per_m", 1, "N s/m", [0, 5.8e-9, 5e-8, 5e-7, 1e-6],
            "none: implicit, one conjugate-gradient solve a sub-step (explicit would need dt < 2 M_i / (5.8 eta))"),
    ]
    # The last force step is that to 400 pN; steps = 1 is the sudden load.
    for name, steps, values in (("stretching, 16 steps", 16, [50, 100, 200, 300, 400]),
                                ("stretching, sudden", 1, [50, 200, 400])):
        rows.append(Series(axis="stretching", name=name, unit="pN", values=values, log=False, judge=axial_diameter,
                           setup=lambda f, n=steps: Setup("stretch.toml", {"stretching.force_pN": f, "stretching.steps": n,
                                                                           "cells.0.vertices": s.vertices}),
                           quantity="axial diameter against 64 force steps, um", cause="link|stretch",
                           source="none: the worm-like chain's force has no bound below its contour length, 2.2 l0"))
    return rows


def flow_rows(s, threshold):
    half = outline(half_step, 2)
    h, dz = 2 * MU / threshold, 45 / (s.nodes[2] - 1)
    courant = lambda speed, nu, dx: largest_courant(2 * speed * dx / nu)
    fastest = next((1e3 * v for v in np.geomspace(1e-2, 10, 200) if 2 * v / h > courant(v, NU, h)), math.inf)
    rows = [Series(
        axis="speed", name=f"mean speed, {name}", unit="mm/s", values=[2, 20, 200], judge=half, quantity=HALF,
        bisect=bisect, setup=lambda v, ramp=ramp: tube(s, boundary__0__velocity_mm_per_s=v, boundary__0__ramp_us=ramp),
        cause=r"step too long|load is too large|Courant|convection", limits=[(fastest, "von Neumann")],
        source="centreline speed dt / h by von Neumann; long before that the membrane's area grows by 10 %, where the run is "
        "stopped: a real one breaks at 4 % (capillary number mu U / mu_0 = 0.35 at 2 mm/s)") for name, ramp, bisect in (("ramp 20 us", 20, s.bisect - 1), ("impulsive", 0, 0))]

    def reynolds(value):
        change = {"fluid__convection": False} if value == 0 else {"fluid__kinematic_viscosity_um2_per_us": 0.02 / value}
        return tube(s, **change)
    rows.append(Series(
        axis="reynolds", name="Reynolds number U D / nu by nu, cell of 100 pg", unit="", values=[0.0182, 0.1, 1, 10, 100],
        judge=half, quantity=HALF, setup=reynolds, cause=UNSTABLE + "|step too long", bisect=s.bisect,
        source=GROWS))
    rows.append(Series(
        axis="reynolds", name="Stokes (convection = false)", unit="", values=[0], log=False, judge=half, quantity=HALF,
        setup=reynolds, cause="", source="none: no convection"))

    def empty_tube(value, dt, end):
        overrides = {"grid.nodes": list(s.nodes), SPEED: 1e3 * value * NU / 10, STEP: dt, "time.end_us": end,
                     "boundary.0.profile": "parabolic", "boundary.0.ramp_us": 0, "output.every_us": end}
        return Setup("tube_flow.toml", overrides)
    rows.append(Series(
        axis="reynolds", name="Reynolds number by speed, no cell, 2 U dt / dz = 0.5", unit="", values=[1, 10, 100],
        setup=lambda re: empty_tube(re, 0.25 * dz / (0.11 * re), 200 * 0.25 * dz / (0.11 * re)), judge=poiseuille,
        quantity="velocity against Poiseuille, over the largest", cause="step too long",
        source="none at this Courant number (von Neumann)"))
    for name in ("conformal", "elliptical"):
        values = {"grid.nodes": list(s.nodes), "grid.cross_section": f'"{name}"', "time.end_us": 20, "boundary.0.ramp_us": 0}
        rows.append(Series(
            axis="grids", name=f"{name} cross-section of a tube, no cell", unit="us of step", values=[1, 10],
            setup=lambda dt, values=values: Setup("tube_flow.toml", values | {STEP: dt}), judge=poiseuille,
            quantity="velocity against Poiseuille, over the largest", cause="skew|grid", source="none: implicit"))
    largest = courant(11, NU, dz)
    rows.append(Series(
        axis="reynolds", name="Courant number 2 U dt / dz at Re 100, no cell", unit="", values=[0.25, 0.5, 1, 2, 4, 16],
        setup=lambda c: empty_tube(100, c * dz / 22, 300 * c * dz / 22), judge=poiseuille, bisect=s.bisect,
        quantity="velocity against Poiseuille, over the largest", cause="step too long|Courant",
        limits=[(largest, "von Neumann")], source="von Neumann at 2 U dz / nu, growth below 1 % a step"))
    return rows


def resolution_rows(s, threshold):
    def edge(vertices):
        return math.sqrt(4 * 134 / (math.sqrt(3) * (2 * vertices - 4)))
    meshes = [n for n in (200, 500, 2000, 8000, 27472) if n <= s.most_vertices]
    h = 2 * MU / threshold
    fine = [2 * n - 1 for n in s.nodes]
    rows = [Series(
        axis="vertices", name=f"vertices, {'x'.join(map(str, nodes))} nodes", unit="", values=values,
        setup=lambda n, nodes=nodes: tube(s, grid__nodes=list(nodes), cells__0__vertices=n, time__end_us=end),
        judge=cell_speed(with_values({"cells.0.vertices": 500})),
        quantity="distance travelled against 500 vertices, relative",
        cause="grid|vertices", source=f"none known; edge over smallest spacing {ratio}") for nodes, values, end, ratio in (
            (s.nodes, meshes, 20, f"{edge(meshes[-1]) / h:.2f} to {edge(200) / h:.1f}"),
            (fine, [200, 500], 10, f"up to about {2 * edge(200) / h:.1f}"))]
    return rows


def grid_rows(s, work):
    def row(name, unit, values, make, cause, source, bisect=0, log=False):
        return Series(axis="grids", name=name, unit=unit, values=values, setup=make, judge=channel_profile, cause=cause,
                      quantity="velocity against plane Poiseuille, over the largest", source=source, bisect=bisect, log=log)
    none = "none: viscous terms and pressure are implicit"
    skews = [0, 30, 45, 60, 75]
    return [
        row("largest skewness", "deg", skews, lambda a: channel(work, f"skew_{a}", skew_deg=a), "skew|grid",
            none + "; only the solvers' convergence is at stake", s.bisect - 1),
        row("largest skewness, implicit convection", "deg", skews,
            lambda a: channel(work, f"skewi_{a}", '"implicit"', skew_deg=a), "skew|grid", none),
        row("aspect ratio", "", [1, 10, 50], lambda a: channel(work, f"aspect_{a}", aspect=a), "grid", none, log=True),
        row("aspect ratio at 45 deg", "", [1, 10, 50], lambda a: channel(work, f"aspects_{a}", aspect=a, skew_deg=45),
            "grid", none, log=True),
        row("jump of spacing, once", "", [1, 2, 3], lambda a: channel(work, f"jump_{a}", jump=a), "grid", none),
        row("jump of spacing, every cell", "", [1, 2, 3], lambda a: channel(work, f"jumps_{a}", jump=a, alternating=True),
            "grid", none + "; the error may fall to first order"),
    ]


def placement_rows(s, work, nodes):
    half = outline(half_step, 2)
    gap = "starting gap of 1 spacing, then 0.75 (src/coupling/flow_simulation.hpp, starting_gap, smallest_gap)"
    cause = r"gap|outside|wall|too narrow|cross|cut off"
    folds = ("the film beside the cell holds; the folds of its rear rim must not pass through each other, nor close "
             "fluid in (src/coupling/immersed_flow.cpp, check_positions): a finer mesh folds later")
    spacing = lambda d: 1.2 * d / (s.nodes[0] - 1)   # of the conformal map next to the wall, midway between its corners
    narrowest = next(d for d in np.arange(7, 14, 0.01) if d / 2 - 3.9 > spacing(d))

    def row(axis, name, unit, values, make, limits=(), bisect=0, judge=half, source=gap):
        return Series(axis=axis, name=name, unit=unit, values=values, setup=make, judge=judge, quantity=HALF, cause=cause,
                      limits=[(v, "program") for v in limits], bisect=bisect, log=False, source=source)
    tilt = lambda a: [math.sin(math.radians(a)), 0, math.cos(math.radians(a))]
    return [
        row("tubes", "tube diameter", "um", [6, 7, 8, 10, 12], lambda d: tube(s, grid__diameter_um=d), [narrowest],
            s.bisect - 1),
        row("tubes", "throat of a narrowing tube", "um", [5, 6, 7, 8], lambda d: narrowing(work, s, nodes, d, s.vertices),
            bisect=s.bisect - 2, source=folds),
        row("tubes", "throat of a narrowing tube, thrice the vertices", "um", [5, 6],
            lambda d: narrowing(work, s, nodes, d, 3 * s.vertices), bisect=s.bisect - 3, source=folds),
        row("placement", "off axis, 10 um tube", "um", [0, 0.25, 0.5, 1, 1.5],
            lambda x: tube(s, cells__0__center_um=[x, 0, 0]), [5 - 3.9 - spacing(10)], s.bisect - 1),
        row("placement", "off axis, 12 um tube", "um", [0, 0.5, 1, 1.5],
            lambda x: tube(s, grid__diameter_um=12, cells__0__center_um=[x, 0, 0]), [6 - 3.9 - spacing(12)]),
        row("placement", "tilt", "deg", [0, 30, 60, 90], lambda a: tube(s, cells__0__axis=tilt(a)), source="none: it fits"),
        row("placement", "centre from touching to outside", "um", [1.1, 2, 5, 9],
            lambda x: tube(s, cells__0__center_um=[x, 0, 0]), source=gap + ": every point refused"),
        row("placement", "two cells, centre to centre", "um", [0.1, 2, 3, 5, 8, 10], lambda z: two_cells(s, z),
            [THICKNESS + 2 * 45 / (s.nodes[2] - 1)], s.bisect - 1,
            source="a fluid node between the rims, so two spacings along the tube at least and three at most: else they cut "
            "the fluid between the dimples off (src/fluid/fluid_solver.cpp, check_connected)"),
    ]


def tolerance_rows(s):
    def row(key, values, bound, source):
        tight = {f"fluid.{key}": values[0]}
        return Series(axis="tolerances", name=f"fluid.{key}", unit="", values=values, judge=outline(with_values(tight)),
                      quantity=f"rms distance to {values[0]:g}, um", cause="toleranc|converge", source=source,
                      setup=lambda v: tube(s, **{f"fluid__{key}": v}))
    return [row("momentum_tolerance", [1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2], 0, "none; round-off near 1e-15"),
            row("divergence_tolerance", [1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2], 0, "none; round-off near 1e-15 in U h^2")]


def all_rows(scale, work, base, force_base):
    threshold = base.report["stability"]["threshold_pg_per_um2_per_us"]
    with h5py.File(base.folder / "fields.h5") as file:
        nodes = np.array(file["nodes_um"])
    return (coupling_rows(scale, threshold) + step_rows(scale, threshold) + membrane_rows(scale)
            + flow_rows(scale, threshold) + resolution_rows(scale, threshold) + grid_rows(scale, work)
            + placement_rows(scale, work, nodes) + tolerance_rows(scale) + stability_force.all_rows(scale, force_base))
