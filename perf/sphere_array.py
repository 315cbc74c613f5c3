#!/usr/bin/env python3
"""Drag of a simple cubic array of spheres against Zick and Homsy (J. Fluid Mech. 115, 1982).

    perf/sphere_array.py [nodes per diameter ...]      default: 12 24

F = 6 pi mu a U K with U the superficial velocity, by the momentum balance (the imposed mean pressure gradient times the
whole volume) and by the tractions on the surface.
"""
import math, os, pathlib, sys, tempfile

import study

EXACT = {0.027: 2.008, 0.064: 2.810, 0.125: 4.292, 0.216: 7.442}
RADIUS, MU, GRADIENT = 5.0, 1.1, 1e-3  # um, mPa s, kPa/um

CASE = """
[time]
step_us = 10
end_us = {end}
[grid]
generator = "box"
nodes = [{n}, {n}, {n}]
lower_um = [{low}, {low}, {low}]
upper_um = [{high}, {high}, {high}]
[fluid]
kinematic_viscosity_um2_per_us = 1.1
density_pg_per_um3 = 1.0
convection = false
pressure_gradient_Pa_per_um = [0, 0, -1]
[[bodies]]
shape = "sphere"
radius_um = {radius}
center_um = [0.013, 0.021, 0.017]
[output]
history_every_us = 50
fields = false
cells = false
"""
SIDES = "".join(f'[[boundary]]\nside = "{s}"\ntype = "periodic"\n'
                for s in ("i_min", "i_max", "j_min", "j_max", "k_min", "k_max"))


def side_um(fraction):
    return RADIUS * (4 * math.pi / 3 / fraction) ** (1 / 3)


def case(fraction, nodes):
    side = side_um(fraction)
    cells = round(side / (2 * RADIUS) * nodes)
    # Twelve times the fluid's mass over the drag: what is left of the start is 1e-5.
    relaxation = side ** 3 / (6 * math.pi * MU * RADIUS * EXACT[fraction])
    end = 10 * max(30, math.ceil(1.2 * relaxation))
    return CASE.format(end=end, n=cells + 1, low=-side / 2, high=side / 2, radius=RADIUS) + SIDES


def drags(fraction, outcome):
    """K by the momentum balance and by the tractions."""
    stokes = 6 * math.pi * MU * RADIUS * outcome.report["superficial_velocity_mm_per_s"][2] * 1e-3
    return GRADIENT * side_um(fraction) ** 3 / stokes, outcome.history[-1]["force_z_nN"] / stokes


def run(fraction, nodes, folder):
    outcome = study.run(case(fraction, nodes), folder=folder, threads=os.environ.get("OMP_NUM_THREADS", 1))
    if not outcome.done:
        sys.exit(f"sphere_array.py: {outcome.message}")
    return *drags(fraction, outcome), outcome.report["wall_s"]


def main():
    sizes = [int(a) for a in sys.argv[1:]] or [12, 24]
    print("fraction,nodes_per_diameter,K_exact,K_balance,K_tractions,error_balance,error_tractions,wall_s")
    with tempfile.TemporaryDirectory() as folder:
        for fraction, exact in EXACT.items():
            for nodes in sizes:
                balance, tractions, wall = run(fraction, nodes, pathlib.Path(folder))
                print(f"{fraction},{nodes},{exact},{balance:.4f},{tractions:.4f},{balance / exact - 1:.4f},"
                      f"{tractions / exact - 1:.4f},{wall:.1f}", flush=True)


if __name__ == "__main__":
    main()
