// An order of a mesh's vertices in which neighbours stand close to each other.
#pragma once

#include <vector>

#include "membrane/mesh.hpp"

namespace corpuscle {

struct EliminationOrder {
  std::vector<int> place;  // [vertex]
  int width = 0;           // largest distance of two neighbours' places
};

/// Level by level from one end of the mesh (Cuthill and McKee, Proc. 24th ACM conference, 1969). The same for the same mesh.
EliminationOrder elimination_order(const TriangleMesh& mesh);

}  // namespace corpuscle
