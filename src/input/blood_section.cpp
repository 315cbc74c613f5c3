// [blood].
#include "input/sections.hpp"

namespace corpuscle {

BloodSettings read_blood(Section& s) {
  constexpr int least_bins = 2, most_bins = 32;
  constexpr double least_um = 0.1;
  BloodSettings b;
  b.from_us = s.number({"from_us", "Time from which means over the flow are taken."}, not_negative(), b.from_us);
  if (s.node("sample_every_us"))
    b.sample_every_us = s.number({"sample_every_us", "Time between two samples."}, positive());
  else
    s.describe({"sample_every_us", "Time between two samples."}, "a number above 0", "ten times time.step_us");
  if (s.node("bins"))
    b.bins = s.integer({"bins", "How many layers profiles have."}, least_bins, most_bins);
  else
    s.describe({"bins", "How many layers profiles have."}, "a whole number from 2 to 32", "about a grid spacing each");
  b.layer_window_um = s.number({"layer_window_um", "Length of the windows along the wall in which the outermost membrane is looked for."},
                               between(least_um, most_um), b.layer_window_um);
  s.finish();
  return b;
}

}  // namespace corpuscle
