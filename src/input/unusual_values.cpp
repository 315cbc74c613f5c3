#include "input/unusual_values.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/units.hpp"

namespace corpuscle {

namespace {

struct Usual {
  double low, high;  // what is told
  double far;        // beyond this many times is warned of
  const char *unit, *what, *other_units;
};

constexpr Usual shear_modulus{2, 20, 50, "uN/m", "red cells have", "1 N/m = 1e6 uN/m, 1 mN/m = 1000 uN/m, 1 dyn/cm = 1000 uN/m"};
constexpr Usual area_modulus{1, 5e5, 50, "uN/m", "models and real membranes have", "1 N/m = 1e6 uN/m, 1 mN/m = 1000 uN/m"};
constexpr Usual bending_modulus{1e-19, 1e-18, 50, "J", "red cells have", "1 k T = 4e-21 J, 1 fJ = 1e-15 J"};
constexpr Usual membrane_viscosity{1e-9, 1e-6, 50, "N s/m", "red cells have", "1 uN s/m = 1e-6 N s/m, 1 dyn s/cm = 1e-3 N s/m"};
constexpr Usual mass{27, 10000, 50, "pg", "cells have", "1 ng = 1000 pg, 1 kg = 1e15 pg"};
constexpr Usual density{0.7, 2, 10, "pg/um3", "watery fluids have about 1, all fluids", "1000 kg/m3 = 1 g/cm3 = 1 pg/um3"};
constexpr Usual pressure_gradient{0, 10, 100, "Pa/um", "vessels have", "1 mmHg/mm = 0.133 Pa/um, 1 kPa/mm = 1 Pa/um"};
constexpr Usual push{0, 1, 50, "nN", "tweezers and pipettes have", "1 pN = 0.001 nN, 1 uN = 1000 nN"};
constexpr Usual kinematic_viscosity{0.5, 100, 50, "um2/us", "plasma has about 1.1, thickened media", "1e-6 m2/s = 1 mm2/s = 1 um2/us"};

double length(const Triple& a) { return std::hypot(a[0], a[1], a[2]); }

struct Texts {
  std::vector<std::string> all;

  /// @param value  in the key's unit
  void look(const std::string& key, double value, const Usual& usual) {
    if (value == 0 || (value >= usual.low / usual.far && value <= usual.high * usual.far)) return;
    all.push_back(fmt::format("{} = {:.6g} is far from what there is: {} {:g} to {:g} {}; is it in {}? ({})", key, value, usual.what,
                              usual.low, usual.high, usual.unit, usual.unit, usual.other_units));
  }
};

void look_at(const CellSettings& cell, const std::string& entry, bool as_forces, Texts& texts) {
  texts.look(entry + ".shear_modulus_uN_per_m", cell.shear_modulus_uN_per_m, shear_modulus);
  texts.look(entry + ".area_modulus_uN_per_m", cell.area_modulus_uN_per_m, area_modulus);
  texts.look(entry + ".local_area_modulus_uN_per_m", cell.local_area_modulus_uN_per_m, area_modulus);
  texts.look(entry + ".bending_modulus_J", cell.bending_modulus_fJ / units::J, bending_modulus);
  texts.look(entry + ".membrane_viscosity_N_s_per_m", cell.membrane_viscosity_N_s_per_m, membrane_viscosity);
  if (!as_forces) texts.look(entry + ".mass_pg", cell.mass_pg, mass);
}

}  // namespace

std::vector<std::string> unusual_values(const Case& scene) {
  Texts texts;
  const bool as_forces = scene.coupling && scene.coupling->scheme == CouplingSettings::Scheme::force;
  if (scene.fluid) {
    texts.look("fluid.density_pg_per_um3", scene.fluid->density_pg_per_um3, density);
    texts.look("fluid.kinematic_viscosity_um2_per_us", scene.fluid->kinematic_viscosity_um2_per_us, kinematic_viscosity);
    texts.look("fluid.pressure_gradient_Pa_per_um", length(scene.fluid->pressure_gradient_Pa_per_um), pressure_gradient);
  }
  for (std::size_t t = 0; t < scene.cell_types.size(); ++t)
    look_at(scene.cell_types[t].cell, fmt::format("cell_types.{}", t), as_forces, texts);
  for (std::size_t c = 0; c < scene.cells.size(); ++c) {
    if (scene.cells[c].type < 0) look_at(scene.cells[c], fmt::format("cells.{}", c), as_forces, texts);
    texts.look(fmt::format("cells.{}.push_nN", c), length(scene.cells[c].push_nN), push);
  }
  return texts.all;
}

}  // namespace corpuscle
