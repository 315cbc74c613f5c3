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
    s.describe({"hematocrit", "Share of the fluid's volume that the cells fill at the start."}, "a number above 0 and up to 0.8; or count",
               "");
    s.describe({"count", "How many cells there are."}, "a whole number; or hematocrit", "");
    return;
  }
  const bool given = s.node("hematocrit"), counted = s.node("count");
  if (counted && given) s.fail("count", "hematocrit says already how many cells there are: leave out one of the two");
  if (counted) {
    p.count = s.integer({"count", "How many cells of the type there are."}, 1, most_cells);
    return;
  }
  if (!given)
    return s.require({"hematocrit", ""},
                     "a number above 0 and up to 0.8 (share of the fluid's volume), or count: how many cells there are");
  p.hematocrit = s.number({"hematocrit", "Share of the fluid's volume that the cells fill."}, positive(most_hematocrit));
}

void read_box(Section& s, PopulationSettings& p) {
  const Bounds anywhere = between(-most_um, most_um);
  const std::string what = "Corner of the box within which the cells start.";
  for (const auto& [key, corner] : {std::pair{"lower_um", &p.lower_um}, {"upper_um", &p.upper_um}}) {
    if (s.node(key))
      *corner = s.triple({key, what}, anywhere);
    else
      s.describe({key, what}, "three numbers [x, y, z]", "");
  }
  for (int d = 0; d < 3 && p.lower_um && p.upper_um; ++d)
    if (!((*p.lower_um)[d] < (*p.upper_um)[d])) s.fail("upper_um", "must be above lower_um in each direction");
}

}  // namespace

PopulationSettings read_population(Section& s, const std::vector<CellTypeSettings>& types) {
  PopulationSettings p;
  if (types.empty()) {
    if (!s.recording()) s.fail("type", "the case has no [[cell_types]]: add one, and name it here");
    s.require({"type", "The type of its cells, by its name."}, "the name of one of [[cell_types]]");
  } else {
    p.type = read_type(s, types);
  }
  read_amount(s, p);
  p.seed =
      s.integer({"seed", "Seed of the random places; the same seed gives the same places on any number of ranks."}, 0, 2000000000, p.seed);
  p.gap_um = s.number({"gap_um", "Least distance of the population's cells from any other surface at the start."}, between(0, 2), p.gap_um);
  p.orientation = s.choice<Orientation>({"orientation", "How the cells' axes point at the start."},
                                        {{"random", Orientation::random}, {"aligned", Orientation::aligned}}, p.orientation);
  if (p.orientation == Orientation::aligned)
    p.axis = read_axis(s);
  else
    s.unused("axis", "only orientation = \"aligned\" has this key");
  read_box(s, p);
  s.finish();
  return p;
}

}  // namespace corpuscle
