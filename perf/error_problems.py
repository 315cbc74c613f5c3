"""The problems of error_vs_time: what is swept in each, how it is run, and its error. Errors are in per cent."""
import h5py
import numpy as np

import compare_outlines
import error_force
import moving_sphere
import sphere_array
import study
from error_sweeps import ExternalProblem, Problem, compare_alone, note_orders, overrides, percent

SOLVER = {"momentum_tolerance": 1e-6, "divergence_tolerance": 5e-11}
CORES = {"threads": 1, "ranks": 1}
NO_REFERENCE = "The reference did not finish: there are no errors."


class ManufacturedFlow(ExternalProblem):
    name, title, program = "a_manufactured", "Manufactured flow, skewed grid", "manufactured_flow"
    what = ("An Arnold-Beltrami-Childress flow that varies in time, with body forces that make it exact, on a skewed and "
            "warped cube of 2 um, to 0.4 us; rms errors over the flow's rms velocity (1.1 um/us) and pressure (0.5 kPa).")
    errors = {"velocity_error_pc": "velocity", "pressure_error_pc": "pressure"}
    default = {"cells": 16, "steps": 16, "momentum_tolerance": 1e-6}

    def sweeps(self):
        return {"cells": [8, 12, 16, 24, 32] + ([48, 64] if self.full else []),
                "steps": [4, 8, 16, 32] + ([64, 128] if self.full else []),
                "momentum_tolerance": [1e-2, 1e-3, 1e-4, 1e-6, 1e-9]}

    def combinations(self):
        return [{"cells": n, "steps": s} for n, s in [(12, 8), (24, 24), (32, 16)] + ([(48, 48)] if self.full else [])]

    def arguments(self, s):
        return [s["cells"], 0.4 / s["steps"], s["steps"], s["momentum_tolerance"]]

    def quantities(self, settings, outcome):
        return {"velocity_error_pc": 100 * outcome.report["velocity_error"] / 1.1,
                "pressure_error_pc": 100 * outcome.report["pressure_error"] / 0.5}


class PlainTube(Problem):
    name, title = "b_tube", "Flow in a straight tube"
    what = ("`cases/tube_flow.toml` without its cell, to 48 us. Developed: largest velocity error in a cross-section against "
            "Poiseuille, over the centreline speed. Start-up: rms velocity error in the same cross-section at the stored "
            "times within the ramp (4 to 20 us), the largest of them; the exact flow for the imposed flow rate comes from "
            "the radial diffusion equation on a grid of 400 points, since far from the inlet it depends on r and t alone.")
    errors = {"developed_error_pc": "developed flow", "startup_error_pc": "start-up"}
    default = {"nodes": "31x31x51", "step_us": 1, "cross_section": "conformal",
               "convection": True, **SOLVER, **CORES}
    radius, mean, ramp, end = 5.0, 2e-3, 20.0, 48

    def sweeps(self):
        return {"nodes": ["16x16x26", "21x21x35", "26x26x43", "31x31x51", "41x41x67"]
                + (["61x61x101", "81x81x134"] if self.full else []),
                "step_us": [8, 4, 2, 1, 0.5] + ([0.25] if self.full else []),
                "cross_section": ["elliptical", "conformal"],
                "convection": [False, True, "implicit"], "momentum_tolerance": [1e-3, 1e-4, 1e-5, 1e-6, 1e-8],
                "divergence_tolerance": [1e-6, 1e-8, 5e-11]}

    def combinations(self):
        return [{"nodes": "21x21x35", "step_us": 4}, {"nodes": "41x41x67", "step_us": 4},
                {"step_us": 4, "momentum_tolerance": 1e-4, "divergence_tolerance": 1e-8, "convection": False}]

    def simulate(self, s, folder, timeout_s):
        fixed = {"time.end_us": self.end, "output.every_us": 4}
        return study.run("tube_flow.toml", overrides(s) | fixed, folder, s["threads"], s["ranks"], timeout_s)

    def quantities(self, settings, outcome):
        e, startup = outcome.report["errors"], self.startup_errors(outcome.folder)
        return {"developed_error_pc": 100 * e["poiseuille_velocity"], "gradient_error_pc": 100 * e["poiseuille_gradient"],
                "startup_error_pc": max(startup.values()), "startup_worst_us": max(startup, key=startup.get),
                "startup_error_at_ramp_end_pc": startup[max(startup)]}

    def startup_errors(self, folder):
        with h5py.File(folder / "fields.h5") as file:
            nodes = file["nodes_um"][()]
            layer = (nodes.shape[0] - 1) * 3 // 4
            corners = nodes[layer:layer + 2]
            x = sum(corners[k, j:corners.shape[1] - 1 + j, i:corners.shape[2] - 1 + i]
                    for i in (0, 1) for j in (0, 1) for k in (0, 1)) / 8
            a = corners[0, 1:, 1:] - corners[0, :-1, :-1]
            b = corners[0, 1:, :-1] - corners[0, :-1, 1:]
            area = 0.5 * np.abs(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
            steps = [g for k, g in file.items() if k.startswith("step_") and 0 < g.attrs["time_us"] <= self.ramp + 1e-9]
            errors = {}
            for group in steps:
                velocity = group["velocity_um_per_us"][layer]
                velocity[..., 2] -= self.exact(group.attrs["time_us"], np.hypot(x[..., 0], x[..., 1]))
                rms = np.sqrt((area * (velocity ** 2).sum(-1)).sum() / area.sum())
                errors[float(group.attrs["time_us"])] = 100 * rms / (2 * self.mean)
        return errors

    _cache = {}

    def exact(self, time, r, points=400, dt=0.01, viscosity=1.1):
        """du/dt = G(t) + nu (1/r) d/dr(r du/dr) with G such that the mean of u is the imposed one; implicit Euler."""
        if not self._cache:
            faces = np.linspace(0, self.radius, points + 1)
            h, volume = faces[1], 0.5 * (faces[1:] ** 2 - faces[:-1] ** 2)
            matrix = np.diag(volume / dt)
            for i in range(1, points):
                c = viscosity * faces[i] / h
                matrix[np.ix_([i - 1, i], [i - 1, i])] += c * np.array([[1, -1], [-1, 1]])
            matrix[-1, -1] += viscosity * faces[-1] / (h / 2)
            inverse = np.linalg.inv(matrix)
            unit, u = inverse @ volume, np.zeros(points)
            for n in range(1, round(self.ramp / dt) + 1):
                u = inverse @ (volume / dt * u)
                u += unit * (self.mean * n * dt / self.ramp - volume @ u / volume.sum()) * volume.sum() / (volume @ unit)
                self._cache[n] = u
            self._cache["r"] = 0.5 * (faces[1:] + faces[:-1])
        u = self._cache[round(time / dt)]
        return np.interp(r, np.append(self._cache["r"], self.radius), np.append(u, 0))


class SphereArray(Problem):
    name, title, fraction = "c_spheres", "Array of spheres", 0.125
    what = ("Drag of a simple cubic array of resting spheres, solid fraction 0.125, Stokes flow (`perf/sphere_array.py`) "
            "against Zick and Homsy (1982), K = 4.292: from the momentum balance and from the tractions on the surface.")
    errors = {"tractions_error_pc": "drag from tractions", "balance_error_pc": "drag from balance"}
    default = {"nodes_per_diameter": 12, "step_us": 10, "body_vertices": "from spacing (0)",
               **SOLVER}

    def sweeps(self):
        return {"nodes_per_diameter": [6, 8, 12, 16, 24] + ([32, 48] if self.full else []),
                "step_us": [30, 10, 3],
                "body_vertices": [100, 300, "from spacing (0)", 1200, 3000],
                "momentum_tolerance": [1e-3, 1e-4, 1e-5, 1e-6, 1e-8],
                "divergence_tolerance": [1e-6, 1e-8, 5e-11]}

    def combinations(self):
        return [{"nodes_per_diameter": 16, "step_us": 30}, {"nodes_per_diameter": 24, "step_us": 30},
                {"nodes_per_diameter": 24, "step_us": 4}]

    def simulate(self, s, folder, timeout_s):
        return study.run(sphere_array.case(self.fraction, s["nodes_per_diameter"]),
                         overrides(s) | {"output.history_every_us": s["step_us"]}, folder, timeout_s=timeout_s)

    def quantities(self, settings, outcome):
        balance, tractions = sphere_array.drags(self.fraction, outcome)
        exact = sphere_array.EXACT[self.fraction]
        force = np.array([row["force_z_nN"] for row in outcome.history[-8:]])
        alternation = 100 * np.sqrt((np.diff(force, 2) ** 2).mean()) / 4 / abs(force.mean()) if len(force) > 5 else 0.0
        return {"alternation_pc": alternation, "K_balance": balance, "K_tractions": tractions, "balance_error_pc": percent(balance, exact),
                "tractions_error_pc": percent(tractions, exact)}

    def finish(self, rows):
        note_orders(self, rows, "nodes_per_diameter", float, {"K_balance": "the balance", "K_tractions": "the tractions"})
        restless = [r for r in rows if r.get("alternation_pc", 0) > 0.05]
        if restless:
            self.notes.append("**Not at rest**: the force still alternates from step to step (rms over the last eight) with "
                              + "; ".join(", ".join(f"{k} {r[k]}" for k in ("nodes_per_diameter", "step_us"))
                                          + f": {r['alternation_pc']:.2g} %" for r in restless) + ".")


class MovingSphere(Problem):
    name, title = "d_moving_sphere", "Sphere moved through the grid"
    what = ("A rigid sphere of 10 um carried through three node spacings in a closed box (`perf/moving_sphere.py`). Jitter: "
            "rms of the traction force about a smooth curve, over its mean. Drag: mean traction force over the speed against "
            "that of the momentum balance in the finest run (no exact answer exists for this box).")
    errors = {"jitter_pc": "jitter of the force", "drag_error_pc": "mean drag from tractions"}
    default = {"nodes_per_diameter": 12, "step_us": 1, "body_vertices": "from spacing (0)",
               **SOLVER}

    def sweeps(self):
        return {"nodes_per_diameter": [8, 12, 16] + ([24, 32] if self.full else [24]), "step_us": [4, 2, 1, 0.5],
                "body_vertices": [200, "from spacing (0)", 2000],
                "momentum_tolerance": [1e-3, 1e-4, 1e-5, 1e-6, 1e-8], "divergence_tolerance": [1e-6, 1e-8, 5e-11]}

    def combinations(self):
        return [{"nodes_per_diameter": 16, "step_us": 4}]

    def references(self):
        return [{"nodes_per_diameter": 48 if self.full else 24, "step_us": 2}]

    def simulate(self, s, folder, timeout_s):
        return study.run(moving_sphere.case(s["nodes_per_diameter"], s["step_us"]), overrides(s), folder,
                         timeout_s=timeout_s)

    def quantities(self, settings, outcome):
        stokes = 6e-3 * np.pi * 1.1 * 5 * moving_sphere.speed_mm_per_s(settings["nodes_per_diameter"])
        force, jitter = moving_sphere.measure(outcome, "force_z_nN")
        balance, balance_jitter = moving_sphere.measure(outcome, "balance_force_z_nN")
        return {"jitter_pc": 100 * jitter, "balance_jitter_pc": 100 * balance_jitter, "K_tractions": -force / stokes,
                "K_balance": -balance / stokes}

    def finish(self, rows):
        done = [r for r in rows if r["code"] == 0]
        if not done:
            return
        finest = max(done, key=lambda r: (r["nodes_per_diameter"], -r["step_us"]))
        for row in done:
            row["drag_error_pc"] = percent(row["K_tractions"], finest["K_balance"])
        self.floors["drag_error_pc"] = note_orders(self, rows, "nodes_per_diameter", float,
                                                   {"K_balance": "the balance", "K_tractions": "the tractions"})


class Stretching(Problem):
    name, title = "e_stretching", "Stretching to 200 pN"
    what = ("`cases/stretch.toml`: axial and transverse diameters at 50, 100, 150 and 200 pN, rms of the relative "
            "differences from the mean over three orientations of the finest mesh. The tolerance of rest decides how many "
            "relaxation steps are made.")
    errors = {"diameters_error_pc": "diameters"}
    default = {"vertices": 500, "force_steps": 16, "rest_tolerance": 1e-4, "spin_deg": 0}
    forces = (50, 100, 150, 200)

    def sweeps(self):
        return {"vertices": [200, 300, 500, 1000, 2000] + ([5000] if self.full else []), "force_steps": [4, 8, 16, 32],
                "rest_tolerance": [0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-7], "spin_deg": [0, 25, 50, 75]}

    def combinations(self):
        return [{"vertices": 1000, "force_steps": 4, "rest_tolerance": 1e-2},
                {"force_steps": 4, "rest_tolerance": 1e-2}, {"vertices": 2000, "force_steps": 4, "rest_tolerance": 1e-2}]

    def references(self):
        n = 9000 if self.full else 3000
        return [{"vertices": n, "force_steps": 4, "rest_tolerance": 1e-5 if self.full else 1e-4, "spin_deg": a}
                for a in (0, 30, 60)]

    def simulate(self, s, folder, timeout_s):
        return study.run("stretch.toml", overrides(s), folder, timeout_s=timeout_s)

    def quantities(self, settings, outcome):
        rows = {round(r["force_pN"], 6): r for r in outcome.history}
        diameters = np.array([[rows[f]["axial_um"], rows[f]["transverse_um"]] for f in self.forces])
        return {"_diameters": diameters, "axial_200pN_um": diameters[-1, 0], "transverse_200pN_um": diameters[-1, 1]}

    def finish(self, rows):
        done = [r for r in rows if r["code"] == 0]
        references = [r["_diameters"] for r in done if r["varied"] == "reference"]
        if not references:
            self.notes.append(NO_REFERENCE)
            return
        mean = np.mean(references, axis=0)
        rms = lambda a, b: 100 * np.sqrt(((a / b - 1) ** 2).mean())
        for row in done:
            if row["varied"] != "reference":
                row["diameters_error_pc"] = rms(row["_diameters"], mean)
        spread = np.mean([rms(r, mean) for r in references])
        self.floors["diameters_error_pc"] = spread / np.sqrt(len(references))
        spins = [r["diameters_error_pc"] for r in done if r["varied"] in ("spin_deg", "default")]
        if spins:
            self.notes.append(f"Turning the mesh of {self.default['vertices']} vertices about its axis gives errors of "
                              f"{min(spins):.2f} to {max(spins):.2f} %: below that, differences are chance.")
        compare_alone(self, done, lambda row, finest: {"alone_pc": rms(row["_diameters"], finest["_diameters"])})


class PushedMembrane(ExternalProblem):
    name, title, program = "f_membrane", "Membrane alone after a push", "membrane_relaxation"
    what = ("A cell without fluid, pushed and left to itself; its extents and elastic energy at the end against those of the "
            "finest membrane step.")
    errors = {"extent_error_pc": "extents"}
    default = {"vertices": 500, "mass_pg": 100, "membrane_viscosity_N_s_per_m": 5.8e-9, "membrane_step_us": 0.5}

    def sweeps(self):
        return {"membrane_step_us": [1, 0.5, 0.25, 0.125, 0.0625], "vertices": [500, 1000],
                "membrane_viscosity_N_s_per_m": [0, 5.8e-9]}

    def references(self):
        return [{"membrane_step_us": 0.01}]

    def arguments(self, s):
        return [s["vertices"], s["mass_pg"], s["membrane_viscosity_N_s_per_m"], s["membrane_step_us"], 100]

    def quantities(self, settings, outcome):
        return {"energy_fJ": outcome.report["elastic_energy_fJ"], "_extent": np.array(outcome.report["extent_um"])}

    def finish(self, rows):
        done = [r for r in rows if r["code"] == 0]
        reference = next((r for r in done if r["varied"] == "reference"), None)
        if not reference:
            self.notes.append(NO_REFERENCE)
        for row in done if reference else []:
            if row is not reference and all(row[k] == reference[k] for k in ("vertices", "membrane_viscosity_N_s_per_m")):
                row["extent_error_pc"] = 100 * np.sqrt(((row["_extent"] / reference["_extent"] - 1) ** 2).mean())


class CellInTube(Problem):
    name, title = "g_cell_in_tube", "Cell in the straight tube"
    errors = {"outline_error_pc": "outline", "same_mesh_error_pc": "outline, same mesh", "speed_error_pc": "cell speed"}
    radius_um = 3.9
    default = {"nodes": "31x31x51", "step_us": 4, "first_step_us": 1, "vertices": 500, "scheme": "robin", "coupling_tolerance": "unused by robin",
               "robin_coefficient": "pi mu / h", "convection": True, **SOLVER, **CORES}

    def __init__(self, full):
        super().__init__(full)
        self.end = 704 if full else 120   # whole numbers of every step
        fine = self.references()[0]
        self.what = (f"`cases/straight_tube.toml` to {self.end} us. Outline: rms distance of the surfaces after putting their "
                     f"centroids together, over {self.radius_um} um (`perf/compare_outlines.py`). Speed: of the cell at the "
                     f"end. Both against the finest run, " + ", ".join(f"{k} = {v}" for k, v in fine.items()) + ". Same "
                     f"mesh: the outline against the finest run with {self.default['vertices']} vertices, which leaves out how "
                     "well that many triangles describe the shape.")

    def sweeps(self):
        iterated = [{"scheme": "iterated", "coupling_tolerance": t} for t in ([1e-1, 1e-2, 1e-3] if self.full else [1e-1, 1e-2])]
        return {"nodes": ["16x16x26", "21x21x35", "26x26x43", "31x31x51", "41x41x67"] + (["61x61x101"] if self.full else []),
                "step_us": [8, 4, 2, 1, 0.5] + ([0.25] if self.full else []),
                "first_step_us": [4, 2, 1, 0.5] + ([0.25] if self.full else []),
                "vertices": [300, 500, 1000, 2000] if self.full else [300, 500, 1000],
                "scheme": [{"scheme": "loose"}, {}] + iterated,
                "robin_coefficient": [30, 20, "pi mu / h", 10] if self.full else [20, "pi mu / h", 10],
                "convection": [False, True] + (["implicit"] if self.full else []),
                "momentum_tolerance": ([1e-2] if self.full else []) + [1e-3, 1e-4, 1e-5, 1e-6] + ([1e-8] if self.full else []),
                "divergence_tolerance": [1e-6] + ([1e-8] if self.full else []) + [5e-11]}

    def combinations(self):
        cheap = {"momentum_tolerance": 1e-4, "divergence_tolerance": 1e-8}
        return [{"step_us": 1, "vertices": 1000}, {**cheap}, {"step_us": 2, "first_step_us": 2},
                {"nodes": "21x21x35", "step_us": 8}, {"nodes": "21x21x35", "step_us": 4, "first_step_us": 4},
                {"nodes": "26x26x43", "step_us": 8}, {"step_us": 2, "first_step_us": 0.5}]

    def references(self):
        fine = {"nodes": "61x61x101" if self.full else "41x41x67", "step_us": 0.5 if self.full else 1, "first_step_us": 0.25}
        return [fine | {"vertices": 2000 if self.full else 1000}, fine]

    def simulate(self, s, folder, timeout_s):
        fixed = {"time.end_us": self.end, "output.every_us": self.end, "output.fields": False,
                 "output.checkpoint_every_us": 0}
        return study.run("straight_tube.toml", overrides(s) | fixed, folder, s["threads"], s["ranks"], timeout_s)

    def quantities(self, settings, outcome):
        last = outcome.history[-1]
        return {"speed_mm_per_s": last["velocity_z_mm_per_s"], "rear_hollow_um": last["rear_hollow_um"],
                "momentum_iterations": outcome.report["iterations"]["momentum"]["mean"],
                "pressure_iterations": outcome.report["iterations"]["pressure"]["mean"],
                "coupling_iterations": outcome.report["iterations"]["coupling"]["mean"]}

    def outline(self, row, reference, time=None):
        found = compare_outlines.compare(row["_run"].folder, reference["_run"].folder, [self.end if time is None else time])
        return 100 * found[-1][1] / self.radius_um

    def finish(self, rows):
        done = [r for r in rows if r["code"] == 0]
        references = [r for r in done if r["varied"] == "reference"]
        if len(references) < 2:
            self.notes.append(NO_REFERENCE)
            return
        finest, same_mesh = references
        for row in done:
            if row["varied"] == "reference":
                continue
            row["outline_error_pc"] = self.outline(row, finest)
            row["speed_error_pc"] = percent(row["speed_mm_per_s"], finest["speed_mm_per_s"])
            if row["vertices"] == same_mesh["vertices"]:
                row["same_mesh_error_pc"] = self.outline(row, same_mesh)
        compare_alone(self, done, lambda row, finest: {
            "outline_alone_pc": self.outline(row, finest),
            "speed_alone_pc": percent(row["speed_mm_per_s"], finest["speed_mm_per_s"])})
        default = next((r for r in done if r["varied"] == "default"), None)
        if default:
            self.notes.append(f"At rest, where the exact distance is zero, the outline of {default['vertices']} vertices is "
                              f"already {self.outline(default, finest, 0):.2f} % from the reference's: flat triangles on a "
                              "curved surface.")
        quantities = {"speed_mm_per_s": "the speed", "rear_hollow_um": "the rear hollow"}
        left = [note_orders(self, rows, "nodes", lambda n: int(n.split("x")[0]) - 1, quantities),
                note_orders(self, rows, "step_us", lambda dt: 1 / dt, quantities),
                note_orders(self, rows, "vertices", lambda n: n ** 0.5, quantities)]
        self.floors["speed_error_pc"] = sum(x for x in left if x is not None)


PROBLEMS = [ManufacturedFlow, PlainTube, SphereArray, MovingSphere, Stretching, PushedMembrane, CellInTube, *error_force.PROBLEMS]
