// [[populations]].
#include "input/sections.hpp"

namespace corpuscle {

namespace {

using Orientation = PopulationSettings::Orientation;

/// How many: one of two keys says.
void read_amount(Section& s, PopulationSettings& p) {
  constexpr int most_cells = 10000000;
  constexpr double most_hematocrit = 0.8;
  if (s.recording()) {
    s.describe("hematocrit", "a number above 0 and up to 0.8: share of the fluid's volume; or count", "");
    s.describe("count", "a whole number: how many cells; or hematocrit", "");
    return;
  }
  const bool given = s.node("hematocrit"), counted = s.node("count");
  if (counted && given) s.fail("count", "hematocrit says already how many cells there are: leave out one of the two");
  if (counted) {
    p.count = s.integer("count", 1, most_cells);
    return;
  }
  if (!given) return s.require("hematocrit", "a number above 0 and up to 0.8 (share of the fluid's volume), or count: how many cells there are");
  p.hematocrit = s.number("hematocrit", positive(most_hematocrit));
}

void read_box(Section& s, PopulationSettings& p) {
  const Bounds anywhere = between(-most_um, most_um);
  for (const auto& [key, corner] : {std::pair{"lower_um", &p.lower_um}, {"upper_um", &p.upper_um}}) {
    if (s.node(key))
      *corner = s.triple(key, anywhere);
    else
      s.describe(key, "three numbers: a corner of the box within which its cells start", "");
  }
  for (int d = 0; d < 3 && p.lower_um && p.upper_um; ++d)
    if (!((*p.lower_um)[d] < (*p.upper_um)[d])) s.fail("upper_um", "must be above lower_um in each direction");
}

}  // namespace

PopulationSettings read_population(Section& s, const std::vector<CellTypeSettings>& types) {
  PopulationSettings p;
  if (types.empty()) {
    if (!s.recording()) s.fail("type", "the case has no [[cell_types]]: add one, and name it here");
    s.require("type", "the name of one of [[cell_types]]");
  } else {
    p.type = read_type(s, types);
  }
  read_amount(s, p);
  p.seed = s.integer("seed", 0, 2000000000, p.seed);
  p.gap_um = s.number("gap_um", between(0, 2), p.gap_um);
  p.orientation =
      s.choice<Orientation>("orientation", {{"random", Orientation::random}, {"aligned", Orientation::aligned}}, p.orientation);
  if (p.orientation == Orientation::aligned)
    p.axis = read_axis(s);
  else
    s.unused("axis", "only orientation = \"aligned\" has this key");
  read_box(s, p);
  s.finish();
  return p;
}

}  // namespace corpuscle
