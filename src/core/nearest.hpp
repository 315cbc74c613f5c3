// Suggestions for misspelt names.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace corpuscle {

/// Number of insertions, deletions, replacements and swaps of neighbours that turn one word into the other.
int edit_distance(std::string_view a, std::string_view b);

/// A key without its unit: "velocity_mm_per_s" and "velocity" both give "velocity".
std::string without_unit(std::string_view key);

/// The entry of `known` most like `word`, or "" where none is alike. A key that differs only in its unit comes first.
std::string nearest(std::string_view word, const std::vector<std::string>& known);

}  // namespace corpuscle
