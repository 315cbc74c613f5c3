// Ends of ranges of [contact] that messages elsewhere need too.
#pragma once

namespace corpuscle {

constexpr double most_aggregation_range_um = 4;

}  // namespace corpuscle
