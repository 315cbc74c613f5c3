// The in-plane laws that a scene can choose. A new one is its header and its name here.
#pragma once

#include <variant>

#include "membrane/spring_law.hpp"

namespace corpuscle {

/// Constants of one cell type. All cells of a scene have the same law: one visit at set-up picks its kernels.
using MembraneLaw = std::variant<WlcPow>;

}  // namespace corpuscle
