// What there is to say of packed cells.
#pragma once

#include <string>
#include <vector>

namespace corpuscle {

struct PackingReport {
  struct Population {
    std::string type;  // its name
    int cells = 0;
    double hematocrit = 0, asked = 0;  // of the fluid's volume; asked is 0 where a count was given
  };
  std::vector<Population> populations;
  double tube_hematocrit = 0;  // of all cells of the scene
  double smallest_gap_um = 0;  // between the surfaces of cells, as contact sees them; 1e30: beyond the reach of the search
  double smallest_wall_gap_um = 0;
  double gaps_seen_um = 0;  // that reach
};

}  // namespace corpuscle
