// The in-plane laws that a scene can choose. A new one is its header and its name here.
#pragma once

#include <variant>

#include "membrane/neo_hookean.hpp"
#include "membrane/skalak.hpp"
#include "membrane/spring_law.hpp"

namespace corpuscle {

/// Constants of one cell type. Kernels are picked at set-up, once for each law that the scene's cells have.
using MembraneLaw = std::variant<WlcPow, NeoHookean, Skalak>;

/// Of the strain, at which a step is refused.
inline double strain_limit(const MembraneLaw& law) {
  return std::visit([](const auto& l) { return l.limit; }, law);
}

}  // namespace corpuscle
