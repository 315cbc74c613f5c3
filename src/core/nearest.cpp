#include "core/nearest.hpp"

#include <algorithm>
#include <array>

namespace corpuscle {

int edit_distance(std::string_view a, std::string_view b) {
  // Optimal string alignment: three rows of the table of distances between prefixes.
  std::vector<int> before(b.size() + 1), previous(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before = previous;
    previous = row;
    row[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const int replaced = previous[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({previous[j] + 1, row[j - 1] + 1, replaced});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row.back();
}

std::string without_unit(std::string_view key) {
  static constexpr std::array units{"per", "nm", "um", "mm", "cm",  "m",   "um2", "um3", "mm2", "mm3", "m2",
                                    "m3",  "ns", "us", "ms", "s",   "fg",  "pg",  "ng",  "g",   "kg",  "pN",
                                    "nN",  "uN", "N",  "Pa", "kPa", "mPa", "J",   "fJ",  "aJ",  "deg", "rad"};
  std::string_view stem = key;
  while (true) {
    const auto cut = stem.rfind('_');
    if (cut == std::string_view::npos || cut == 0) break;
    const auto last = stem.substr(cut + 1);
    if (std::find(units.begin(), units.end(), last) == units.end()) break;
    stem = stem.substr(0, cut);
  }
  return std::string(stem);
}

std::string nearest(std::string_view word, const std::vector<std::string>& known) {
  std::string best;
  // A third of the word may differ: beyond that a suggestion is more confusing than none.
  int closest = std::max(2, static_cast<int>(word.size()) / 3) + 1;
  const auto stem = without_unit(word);
  for (const auto& candidate : known) {
    const bool same_but_unit = without_unit(candidate) == stem;
    const int distance = same_but_unit ? 0 : edit_distance(word, candidate);
    if (distance < closest) {
      closest = distance;
      best = candidate;
    }
  }
  return best;
}

}  // namespace corpuscle
