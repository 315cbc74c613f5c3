#!/usr/bin/env python3
"""Noise of the force on a sphere carried through the grid for three node spacings at constant speed.

    perf/moving_sphere.py [nodes per diameter:step_us ...]      default: 12:1 12:2 12:4 18:1

The sphere (10 um) moves along the axis of a closed box of 16.12 um with an open end. The jitter is the rms deviation from a
parabola in time, which takes out the smooth effect of the walls.
"""
import csv, pathlib, subprocess, sys, tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
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


def run(nodes, step, folder):
    cells = round(SIDE / 10 * nodes)
    spacing = SIDE / cells
    case = folder / "moving.toml"
    case.write_text(CASE.format(step=step, end=WARM_US + TRAVEL_US, n=cells + 1, low=-SIDE / 2,
                                high=SIDE / 2, start=-1.5 * spacing, speed=3 * spacing / TRAVEL_US * 1e3) + SIDES)
    subprocess.run([ROOT / "build/openmp/corpuscle", "run", case, "--out", folder / "out"], check=True,
                   stdout=subprocess.DEVNULL)
    rows = [r for r in csv.DictReader(open(folder / "out/history.csv")) if float(r["time_us"]) > WARM_US]
    time = np.array([float(r["time_us"]) for r in rows])
    for column in ("force_z_nN", "balance_force_z_nN"):
        force = np.array([float(r[column]) for r in rows])
        smooth = np.polyval(np.polyfit(time - time.mean(), force, 2), time - time.mean())
        print(f"{nodes},{step},{column},{force.mean():.3f},{(force - smooth).std() / abs(force.mean()):.5f}", flush=True)


def main():
    print("nodes_per_diameter,step_us,force,mean_nN,jitter_rms_over_mean")
    with tempfile.TemporaryDirectory() as folder:
        for item in sys.argv[1:] or ["12:1", "12:2", "12:4", "18:1"]:
            nodes, step = item.split(":")
            run(int(nodes), float(step), pathlib.Path(folder))


if __name__ == "__main__":
    main()
