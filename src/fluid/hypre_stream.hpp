// Kernels of hypre and ours, one after the other.
#pragma once

#include <Kokkos_Core.hpp>

namespace corpuscle {

/// On a device hypre's kernels run in a stream of its own, which a fence of our execution space does not wait for, and its calls
/// return while they still read our arrays or write them. Before our kernels touch either.
inline void wait_for_hypre() { Kokkos::fence(); }

}  // namespace corpuscle
