// [contact].
#include <fmt/format.h>

#include "core/units.hpp"
#include "input/contact_limits.hpp"
#include "input/sections.hpp"

namespace corpuscle {

ContactSettings read_contact(Section& s) {
  constexpr double least_um = 0.01, most_contact_um = 2, most_fJ_per_um2 = 10;
  constexpr double least_Pa = 0.01, most_Pa = 1e6;  // the least: what plasma shears with at 10 /s
  ContactSettings c;
  c.range_um = s.number({"range_um", "Distance between surfaces below which they repel each other."}, between(least_um, most_contact_um),
                        c.range_um);
  c.pressure =
      s.number({"pressure_Pa", "Repulsive pressure at a gap of half the range."}, between(least_Pa, most_Pa), c.pressure / units::Pa) *
      units::Pa;
  c.aggregation_energy =
      s.number({"aggregation_energy_fJ_per_um2", "Energy an area of two membranes gains by coming together; 0: no attraction."},
               between(0, most_fJ_per_um2), c.aggregation_energy);
  const Key reach{"aggregation_range_um", "Gap up to which membranes attract each other."};
  if (c.aggregation_energy > 0) {
    c.aggregation_range_um = s.number(reach, between(least_um, most_aggregation_range_um), 2 * c.range_um);
    if (c.aggregation_range_um < 1.2 * c.range_um)
      s.fail(reach.name, "must be at least 1.2 times range_um, where the repulsion ends and the attraction is strongest");
  } else {
    s.describe(reach, fmt::format("a number from {:g} to {:g}, at least 1.2 times range_um", least_um, most_aggregation_range_um),
               "twice range_um");
    s.unused(reach.name, "only with aggregation_energy_fJ_per_um2 above 0");
  }
  s.finish();
  return c;
}

}  // namespace corpuscle
