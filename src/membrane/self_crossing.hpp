// Whether a surface passes through itself.
#pragma once

#include <optional>

#include "membrane/mesh.hpp"

namespace corpuscle {

struct Crossing {
  int first = 0, second = 0;  // triangles, first < second
  Triple at{};                // um, a point of both
};

/// The crossing with the lowest triangle numbers. An edge that goes through another triangle's inside is one, and two
/// neighbours folded flat onto each other; surfaces that touch are not. Takes n log n operations for n triangles of
/// like sizes.
std::optional<Crossing> find_self_crossing(const TriangleMesh& mesh);

}  // namespace corpuscle
