// The geometry of one rank's block, as kernels see it.
#pragma once

#include "grid/index_space.hpp"

namespace corpuscle {

/// All views have index.size() entries (see IndexSpace for the order and the meaning of the halo layers).
struct GridViews {
  IndexSpace index;
  Components<double> x;             // [cell, 3] cell centre, um; beyond a physical boundary: boundary face centre
  Components<double> face_area[3];  // [cell, 3] area vector, um2, of the face between cell - stride(d) and cell,
                                    // pointing along +d; the six of a cell close exactly
  Array<double> volume;             // [cell] um3
  Array<NodeKind> base_kind;        // [cell] kind without bodies: fluid, boundary or none
};

}  // namespace corpuscle
