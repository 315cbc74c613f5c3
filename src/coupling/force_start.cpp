// What there is to warn of at the start of membranes that are forces.
#include <fmt/format.h>

#include <algorithm>

#include "contact/wall_contact.hpp"
#include "core/log.hpp"
#include "coupling/force_coupling.hpp"
#include "fluid/boundary_conditions.hpp"
#include "immersed/surface.hpp"
#include "parallel/agree.hpp"

namespace corpuscle {

namespace {

/// nN/um
double shear_modulus(const MembraneLaw& law) {
  return std::visit(
      [](const auto& l) {
        if constexpr (requires { l.spring; })
          return l.spring.stiffness * shear_modulus_over_stiffness();
        else
          return l.material.shear_modulus;
      },
      law);
}

}  // namespace

/// Without contact nothing but the fluid keeps cells from a wall, and between nodes there is none.
void ForceCoupling::warn_of_walls() const {
  constexpr double near = 0.5;  // spacings
  if (loads_ && loads_->report()) return;
  const WallSides sides = walls_of(scene_.boundaries);
  if (!sides.any()) return;
  const Comm& comm = fluid_.grid().comm();
  const double spacing = fluid_.grid().mean_spacing();
  const double least = comm.min(least_wall_gap({transfer_->block().lattice, transfer_->views(), sides, surfaces(), near * spacing}));
  if (least < near * spacing)
    warn(
        "a cell starts {:.2g} um from a wall, {:.2g} spacings of the grid, and there is no [contact]: nothing resolves the film between "
        "them, and that the cell goes through the wall would be seen late; add [contact], move the cell (center_um), or refine the grid "
        "(grid.nodes)",
        least, least / spacing);
}

/// Fluids as different as these, side by side in few spacings, are not resolved as well as others.
void ForceCoupling::warn_of_ratios() const {
  constexpr double least = 0.35, most = 10;  // a sphere of three spacings, held: 14 and 13 % too much
  std::vector<double> told;                  // once, of however many types
  for (const CellReference& type : membranes_->types()) {
    const double ratio = type.viscosity_ratio;
    if ((ratio >= least && ratio <= most) || std::find(told.begin(), told.end(), ratio) != told.end()) continue;
    told.push_back(ratio);
    warn(
        "viscosity_ratio = {:g}: cells that hardly deform resist the flow too much around a fluid that is {}: a sphere of three spacings "
        "of the "
        "grid a radius adds {} too much to the viscosity, one of five {}; compare with a finer grid (grid.nodes)",
        ratio, ratio < least ? "a third as viscous as that outside or less" : "more than ten times as viscous",
        ratio < least ? "a fifth to a third" : "a quarter to a half", ratio < least ? "a tenth to a sixth" : "a tenth to a fifth");
  }
}

/// A cell that is alone meets itself beyond periodic sides.
void ForceCoupling::warn_of_image() const {
  constexpr double near = 0.25;  // of its extent
  if (cells_->total() != 1 || (loads_ && loads_->report())) return;
  std::string text;
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), surfaces().x);
  for (int d = 0; d < 3 && !cells_->own().empty(); ++d) {
    if (!fluid_.grid().index().periodic[d]) continue;
    const Triple& period = fluid_.grid().period(d);
    const double length = std::hypot(period[0], period[1], period[2]);
    double low = 1e300, high = -1e300;
    for (int v = 0; v < membranes_->vertices(); ++v) {
      const double along = (x(v, 0) * period[0] + x(v, 1) * period[1] + x(v, 2) * period[2]) / length;
      low = std::min(low, along), high = std::max(high, along);
    }
    if (length - (high - low) < near * (high - low))
      text = fmt::format(
          "{} is {:.3g} um from its own image beyond a periodic side, and there is no [contact]: that they cross would "
          "not be seen; add [contact], or use a larger grid",
          body_name(surfaces(), 0), length - (high - low));
  }
  text = agree(fluid_.grid().comm(), text);
  if (!text.empty()) warn("{}", text);
}

/// Cells that start deep within each other's repulsion are thrown apart by it, not by the flow.
void ForceCoupling::warn_of_pressed_start() const {
  constexpr double much = 0.05;
  if (!loads_ || !loads_->report()) return;
  const Comm& comm = fluid_.grid().comm();
  double elastic = 0;
  for (const CellRecord& cell : cells_->own()) {
    const CellReference& type = membranes_->types()[cell.type];
    elastic += shear_modulus(type.in_plane) * type.law.rest_area;
  }
  elastic = comm.sum(elastic);
  const double contact = comm.sum(loads_->contact_energy(lengths_us_.front()));
  if (!(contact > much * elastic)) return;
  const ContactReport report = *loads_->report();
  warn(
      "contact: cells start pressed against each other or against walls, with gaps down to {:.2g} um: contact gives off up to {:.3g} fJ, "
      "{:.2g} of the membranes' shear modulus times their area, which moves cells and fluid until it is spent: lower contact.range_um "
      "or contact.pressure_Pa, start them farther apart (populations.0.gap_um, center_um), or begin to measure later (blood.from_us)",
      report.smallest(), contact, contact / elastic);
}

}  // namespace corpuscle
