"""The problems of error_vs_time whose membranes are forces. Errors are in per cent."""
import functools
import re
import subprocess

import numpy as np

import cell_files
import compare_outlines
import force_scenes
import study
from error_sweeps import KEYS, Problem, compare_alone, note_orders, percent

RADIUS_um = 3.9
SOLVER = {"momentum_tolerance": 1e-6, "divergence_tolerance": 5e-11}


@functools.cache
def allowed(section, key):
    """The values that a key of the program takes, its default first; none where it has no such key."""
    said = subprocess.run([str(study.program()), "keys", section], capture_output=True, text=True).stdout
    line = next((line for line in said.splitlines() if line.strip().startswith(key + ":")), "")
    values = re.findall(r'"([^"]+)"', line.split(": ", 1)[-1].split("; only")[0])
    return list(dict.fromkeys(values[-1:] + values[:-1]))


class ForceProblem(Problem):
    """Settings are keys of error_sweeps, and `spacing_um`. The reference is the finest run with the slip correction. What is not
    corrected falls with the first power of the spacing: the uncertainty of a number is how far the reference is from the limit of runs
    without slip at two spacings; of a shape, half of how far it is from the finest without; and what the finest step leaves."""
    end_us = 0
    fine = {}           # of the references, --quick and --full
    finer = {}
    quantity = ""       # column by which orders are fitted
    column = ""         # that of its error
    numbers = {}        # errors that are those of one number: its column
    slip = True         # default

    def __init__(self, full):
        super().__init__(full)
        self.default = dict(self.default) | {"kernel": "three-point", "slip": self.slip}
        self.pressures = allowed("coupling", "pressure")
        if self.pressures:
            self.default |= {"pressure": self.pressures[0]}
        self.default |= SOLVER
        self.what = self.what.format(end=f"{self.end():g}", **self.default) + (
            " Errors are against the run with " + ", ".join(f"{k} {v}" for k, v in self.references()[0].items()) + ".")

    def end(self):
        return self.end_us * (4 if self.full else 1)

    def sweeps(self):
        pressure = {"pressure": self.pressures[::-1]} if self.pressures else {}
        return {"kernel": [{"kernel": "four-point", "slip": False}, {"kernel": "four-point", "step_us": self.default["step_us"] / 2}, {}],
                "slip": [not self.slip, self.slip]} | pressure

    def references(self):
        fine = self.finer if self.full else self.fine
        return [fine | {"slip": True}, fine | {"slip": False}, fine | {"slip": False, "spacing_um": self.default["spacing_um"]}]

    def plan(self, cores):
        """References first: without them there are no errors at all."""
        return sorted(super().plan(cores), key=lambda plan: plan.varied != "reference")

    def case(self, settings):
        raise NotImplementedError

    def simulate(self, s, folder, timeout_s):
        text = self.case(s)
        listed = "cell_types" if "[[cell_types]]" in text else "cells"
        keys = {k: KEYS[k].replace("cells.0.", f"{listed}.0.") for k in s if k in KEYS}
        fixed = {"time.end_us": self.end(), "output.every_us": self.end()}
        return study.run(text, {keys[k]: s[k] for k in keys} | fixed, folder, timeout_s=timeout_s)

    def finish(self, rows):
        done = [r for r in rows if r["code"] == 0]
        references = [r for r in done if r["varied"] == "reference"]
        if len(references) < 3:
            self.notes.append("The references did not finish: there are no errors.")
            return
        finest, uncorrected, coarse = references
        for row in done:
            if row["varied"] != "reference":
                row |= {column: self.difference(column, row, finest) for column in self.errors}
        ratio = coarse["spacing_um"] / finest["spacing_um"]
        for column in self.errors:
            self.floors[column] = 0.5 * self.difference(column, finest, uncorrected)
        for column, number in self.numbers.items():
            limit = uncorrected[number] + (uncorrected[number] - coarse[number]) / (ratio - 1)
            self.floors[column] = percent(finest[number], limit)
        quantities = {self.quantity: self.errors[self.column]}
        note_orders(self, rows, "spacing_um", lambda h: 1 / h, quantities)
        self.floors[self.column] += note_orders(self, rows, "step_us", lambda dt: 1 / dt, quantities) or 0
        name = self.errors[self.column]
        compare_alone(self, done, lambda row, finest: {f"{name}_alone_pc": self.difference(self.column, row, finest)})

    def difference(self, column, row, other):
        """Per cent of the other's."""
        return percent(row[self.numbers[column]], other[self.numbers[column]])


class Capsule(ForceProblem):
    name, title = "h_capsule", "Capsule in shear"
    what = ("`cases/capsule_shear.toml` in a box of 18 um, six radii, at a capillary number of 0.3, to {end} us (a shear of half "
            "in --quick): Taylor's deformation D of a neo-Hookean capsule over the run, largest difference over its value at the end.")
    errors = {"deformation_error_pc": "deformation"}
    quantity, column = "deformation", "deformation_error_pc"
    numbers = {"deformation_error_pc": "deformation"}
    default = {"spacing_um": 0.75, "step_us": 100, "vertices": 500, "viscosity_ratio": 1}
    end_us = 5000
    fine = {"spacing_um": 0.45, "step_us": 25, "vertices": 1000}
    finer = {"spacing_um": 0.25, "step_us": 10, "vertices": 2000}

    def sweeps(self):
        return {"spacing_um": [1.5, 1, 0.75, 0.6, 0.5] + ([0.375] if self.full else []), "step_us": [200, 100, 50, 25],
                "vertices": [200, 320, 500, 1000]} | super().sweeps()

    def combinations(self):
        return [{"spacing_um": 1, "vertices": 320, "step_us": 200}, {"spacing_um": 1, "vertices": 320, "slip": False, "step_us": 250},
                {"spacing_um": 0.6, "vertices": 320, "step_us": 50}, {"spacing_um": 0.5, "kernel": "four-point", "slip": False}]

    def simulate(self, s, folder, timeout_s):
        text = (study.ROOT / "cases/capsule_shear.toml").read_text()
        n = round(18 / s["spacing_um"]) + 1
        keys = {KEYS[k]: v for k, v in s.items() if k in KEYS}
        fixed = {"grid.nodes": [n, n, n], "grid.lower_um": [-9, -9, -9], "grid.upper_um": [9, 9, 9],
                 "boundary.0.velocity_mm_per_s": [-0.9, 0, 0], "boundary.1.velocity_mm_per_s": [0.9, 0, 0],
                 "time.end_us": self.end(), "output.every_us": self.end(), "output.history_every_us": 1000, "output.fields": False}
        return study.run(text, keys | fixed, folder, timeout_s=timeout_s)

    def quantities(self, settings, outcome):
        series = {round(r["time_us"]): r["deformation"] for r in outcome.history if round(r["time_us"]) % 1000 == 0}
        return {"deformation": outcome.history[-1]["deformation"], "_series": series}

    def difference(self, column, row, other):
        both = set(row["_series"]) & set(other["_series"])
        return 100 * max(abs(row["_series"][t] - other["_series"][t]) for t in both) / other["deformation"]


class ViscousCapsule(Capsule):
    name, title = "i_viscous_capsule", "Capsule in shear, five times as viscous inside"
    what = Capsule.what.replace("a neo-Hookean capsule", "a neo-Hookean capsule with a viscosity ratio of 5")
    default = Capsule.default | {"viscosity_ratio": 5}
    fine = {"spacing_um": 0.5, "step_us": 50, "vertices": 800}

    def sweeps(self):
        keys = super().sweeps()
        return {"spacing_um": [1.5, 1, 0.75, 0.6], "step_us": [200, 100, 50], "vertices": [320, 500], "viscosity_ratio": [1, 5],
                **{k: keys[k] for k in ("kernel", "slip", "pressure") if k in keys}}

    def combinations(self):
        return [{"spacing_um": 1, "vertices": 320, "step_us": 200}]


class CellInShear(ForceProblem):
    name, title = "j_cell_in_shear", "Red cell in shear"
    what = ("A red cell, aslant, with a viscosity ratio of 5, between walls 12 um apart at 1000 /s, to {end} us. Outline: rms distance of the "
            f"surfaces after putting their centroids together, over {RADIUS_um} um. Deformation: of the ellipsoid of equal inertia.")
    errors = {"outline_error_pc": "outline", "deformation_error_pc": "deformation"}
    quantity, column = "deformation", "deformation_error_pc"
    numbers = {"deformation_error_pc": "deformation"}
    default = {"spacing_um": 0.6, "step_us": 20, "vertices": 500, "viscosity_ratio": 5}
    end_us = 600
    fine = {"spacing_um": 0.4, "step_us": 10, "vertices": 1000}
    finer = {"spacing_um": 0.2, "step_us": 2, "vertices": 2000}

    def sweeps(self):
        return {"spacing_um": [1, 0.75, 0.6, 0.5] + ([0.4, 0.3] if self.full else []), "step_us": [50, 40, 20, 10] + ([5] if self.full else []),
                "vertices": [200, 300, 500, 1000], "viscosity_ratio": [1, 5], "momentum_tolerance": [1e-4, 1e-6],
                "divergence_tolerance": [1e-8, 5e-11]} | super().sweeps()

    def combinations(self):
        cheap = {"momentum_tolerance": 1e-4, "divergence_tolerance": 1e-8}
        return [{"spacing_um": 0.75, "step_us": 40, "vertices": 300}, {"spacing_um": 0.75, "slip": False, "vertices": 300} | cheap,
                {"spacing_um": 0.75, "step_us": 40} | cheap]

    def case(self, s):
        return force_scenes.box("A red cell in shear", (12, 12, 9), s["spacing_um"], force_scenes.one_aslant(500), 1000, self.end())

    def quantities(self, settings, outcome):
        return {"deformation": outcome.history[-1]["deformation"], "inclination_deg": outcome.history[-1]["inclination_deg"]}

    def difference(self, column, row, other):
        if column in self.numbers:
            return super().difference(column, row, other)
        return 100 * compare_outlines.compare(row["_run"].folder, other["_run"].folder, [self.end()])[-1][1] / RADIUS_um


class TwoCells(ForceProblem):
    name, title = "k_two_cells", "Two cells pressed together"
    what = ("Two red cells face to face in a periodic box of 12 um, rims 0.35 um from each other, pressed with 0.2 nN, to {end} us. Gap: the "
            "smallest between them, over the reference's. Way: how far their centroids have come, over the reference's.")
    errors = {"gap_error_pc": "gap", "way_error_pc": "way"}
    quantity, column = "gap_um", "gap_error_pc"
    numbers = {"gap_error_pc": "gap_um", "way_error_pc": "way_um"}
    default = {"spacing_um": 0.6, "step_us": 20, "vertices": 500, "contact_range_um": 0.25}
    end_us = 1000
    fine = {"spacing_um": 0.4, "step_us": 10, "vertices": 1000}
    finer = {"spacing_um": 0.2, "step_us": 2, "vertices": 2000}

    def sweeps(self):
        return {"spacing_um": [1, 0.75, 0.6, 0.5] + ([0.4, 0.3] if self.full else []), "step_us": [50, 40, 20, 10] + ([5] if self.full else []),
                "vertices": [200, 300, 500] + ([1000] if self.full else []), "contact_range_um": [0.5, 0.25, 0.1]} | super().sweeps()

    def combinations(self):
        return [{"spacing_um": 0.75, "vertices": 300, "step_us": 40}, {"slip": False, "contact_range_um": 0.1}]

    def case(self, s):
        return force_scenes.box("Two cells pressed together", (12, 12, 12), s["spacing_um"], force_scenes.two_face_to_face(500, 0.35, 0.2),
                                0, self.end())

    def quantities(self, settings, outcome):
        place = lambda r: np.array([r[f"centroid_{d}_um"] for d in "xyz"])
        cells = [[place(r) for r in outcome.history if r["cell"] == c] for c in (0, 1)]
        come = np.linalg.norm(cells[1][0] - cells[0][0]) - np.linalg.norm(cells[1][-1] - cells[0][-1])
        stored = cell_files.Cells(outcome.folder)
        surfaces = [stored.cell(c, stored.last) for c in (0, 1)]
        gap = min(compare_outlines.distances(a[0], *b).min() for a, b in (surfaces, surfaces[::-1]))
        return {"gap_um": gap, "way_um": come}


class Pack(TwoCells):
    name, title = "l_pack", "Pack of cells in shear"
    what = ("Seven red cells (hematocrit 0.37) in a periodic box of 12 um between walls that slide past each other at 500 /s, to {end} us; a "
            "viscosity ratio of 5. Work: that of the walls, as the apparent viscosity goes. Places: rms distance of the centroids from the "
            "reference's, over the rms way that they have come.")
    errors = {"work_error_pc": "work of the walls", "places_error_pc": "places of the cells"}
    quantity, column = "work_fJ", "work_error_pc"
    numbers = {"work_error_pc": "work_fJ"}
    default = {"spacing_um": 0.6, "step_us": 20, "vertices": 500, "contact_range_um": 0.25, "viscosity_ratio": 5}
    end_us = 240
    slip = False        # as cases of dense blood leave it out
    places = (((2.78, -3.27, 3.1), (-0.47, -0.87, 0.17)), ((-3.06, 2.14, 5.72), (0.94, -0.35, 0.01)),
              ((-5.22, 0.76, -1.22), (-0.32, -0.6, 0.74)), ((4.38, 2.45, -4.53), (-0.42, 0.57, -0.71)),
              ((-4.85, -2.75, -0.24), (0.3, 0.71, -0.64)), ((1.25, 2.21, 2.0), (0.9, 0.43, 0.0)),
              ((-0.73, -1.97, -3.83), (0.96, -0.05, -0.28)))

    def sweeps(self):
        return {"spacing_um": [1, 0.75, 0.6, 0.5] + ([0.4, 0.3] if self.full else []), "step_us": [60, 40, 20, 10],
                "vertices": [300, 500] + ([1000] if self.full else []), "contact_range_um": [0.5, 0.25, 0.1],
                "viscosity_ratio": [1, 5]} | ForceProblem.sweeps(self)

    def combinations(self):
        cheap = {"momentum_tolerance": 1e-4, "divergence_tolerance": 1e-8}
        return [{"spacing_um": 0.75, "vertices": 300, "step_us": 40} | cheap, cheap]

    def case(self, s):
        return force_scenes.box("A pack of cells in shear", (12, 12, 12), s["spacing_um"], force_scenes.placed(500, self.places), 500,
                                self.end())

    def quantities(self, settings, outcome):
        ends = outcome.history[0]["time_us"], outcome.history[-1]["time_us"]
        at = [np.array([[r[f"centroid_{d}_um"] for d in "xyz"] for r in outcome.history if r["time_us"] == t]) for t in ends]
        return {"work_fJ": outcome.report["energy_fJ"]["boundaries"], "_ends": at,
                "gap_um": outcome.report["contact"]["smallest_gap_um"], "energy_balance_pc": 100 * outcome.report["errors"]["energy_balance"]}

    def difference(self, column, row, other):
        if column in self.numbers:
            return super().difference(column, row, other)
        rms = lambda d: np.sqrt((d ** 2).sum(1).mean())
        way = [r["_ends"][1] - r["_ends"][0] for r in (row, other)]
        return 100 * rms(way[0] - way[1]) / rms(way[1])


PROBLEMS = [Capsule, ViscousCapsule, CellInShear, TwoCells, Pack]
