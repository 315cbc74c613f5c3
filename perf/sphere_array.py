#!/usr/bin/env python3
"""Drag of a simple cubic array of spheres against Zick and Homsy (J. Fluid Mech. 115, 1982).

    perf/sphere_array.py [nodes per diameter ...]      default: 12 24

F = 6 pi mu a U K with U the superficial velocity, by the momentum balance (the imposed mean pressure gradient times the
whole volume) and by the tractions on the surface.
"""
import csv, json, math, pathlib, subprocess, sys, tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
EXACT = {0.027: 2.008, 0.064: 2.810, 0.125: 4.292, 0.216: 7.442}
RADIUS, MU, GRADIENT = 5.0, 1.1, 1e-3  # um, mPa s, kPa/um

CASE = """
[time]
step_us = 10
end_us = 300
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


def run(fraction, nodes, folder):
    side = RADIUS * (4 * math.pi / 3 / fraction) ** (1 / 3)
    cells = round(side / (2 * RADIUS) * nodes)
    case = folder / "array.toml"
    case.write_text(CASE.format(n=cells + 1, low=-side / 2, high=side / 2, radius=RADIUS) + SIDES)
    subprocess.run([ROOT / "build/openmp/corpuscle", "run", case, "--out", folder / "out"], check=True,
                   stdout=subprocess.DEVNULL)
    report = json.loads((folder / "out/report.json").read_text())
    last = list(csv.DictReader(open(folder / "out/history.csv")))[-1]
    stokes = 6 * math.pi * MU * RADIUS * report["superficial_velocity_mm_per_s"][2] * 1e-3
    return GRADIENT * side ** 3 / stokes, float(last["force_z_nN"]) / stokes, report["wall_s"]


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
