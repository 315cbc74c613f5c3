#!/usr/bin/env python3
"""Noise of the force on a sphere carried through the grid for three node spacings at constant speed.

    perf/moving_sphere.py [nodes per diameter:step_us ...]      default: 12:1 12:2 12:4 18:1

The sphere (10 um) moves along the axis of a closed box of 16.12 um with an open end. The jitter is the rms deviation from a
parabola in time, which takes out the smooth effect of the walls.
"""
import os, pathlib, sys, tempfile

import study

study.need("numpy")
import numpy as np

SIDE, WARM_US, TRAVEL_US = 16.12, 20.0, 60.0
CASE = """
[time]
step_us = {step}
end_us = {end}
[grid]
generator = "box"
nodes = [{n}, {n}, {n}]
lower_um = [{low}, {low}, {low}]
upper_um = [{high}, {high}, {high}]
[fluid]
density_pg_per_um3 = 1.0
kinematic_viscosity_um2_per_us = 1.1
convection = false
[[bodies]]
shape = "sphere"
radius_um = 5
center_um = [0.013, 0.021, {start}]
velocity_mm_per_s = [0, 0, {speed}]
[output]
fields = false
cells = false
[[boundary]]
side = "k_max"
type = "outflow"
"""
SIDES = "".join(f'[[boundary]]\nside = "{s}"\ntype = "wall"\n' for s in ("i_min", "i_max", "j_min", "j_max", "k_min"))


def speed_mm_per_s(nodes):
    return 3 * SIDE / round(SIDE / 10 * nodes) / TRAVEL_US * 1e3


def case(nodes, step):
    cells = round(SIDE / 10 * nodes)
    return CASE.format(step=step, end=WARM_US + TRAVEL_US, n=cells + 1, low=-SIDE / 2, high=SIDE / 2,
                       start=-1.5 * SIDE / cells, speed=speed_mm_per_s(nodes)) + SIDES


def measure(outcome, column):
    """Mean force, nN, and its rms jitter over the mean."""
    rows = [row for row in outcome.history if row["time_us"] > WARM_US]
    time = np.array([row["time_us"] for row in rows])
    force = np.array([row[column] for row in rows])
    smooth = np.polyval(np.polyfit(time - time.mean(), force, 2), time - time.mean())
    return force.mean(), (force - smooth).std() / abs(force.mean())


def run(nodes, step, folder):
    outcome = study.run(case(nodes, step), folder=folder, threads=os.environ.get("OMP_NUM_THREADS", 1))
    if not outcome.done:
        sys.exit(f"moving_sphere.py: {outcome.message}")
    for column in ("force_z_nN", "balance_force_z_nN"):
        mean, jitter = measure(outcome, column)
        print(f"{nodes},{step},{column},{mean:.3f},{jitter:.5f}", flush=True)


def main():
    print("nodes_per_diameter,step_us,force,mean_nN,jitter_rms_over_mean")
    with tempfile.TemporaryDirectory() as folder:
        for item in sys.argv[1:] or ["12:1", "12:2", "12:4", "18:1"]:
            nodes, step = item.split(":")
            run(int(nodes), float(step), pathlib.Path(folder))


if __name__ == "__main__":
    main()
