// Spaces, views and index types shared by every kernel.
#pragma once

#include <Kokkos_Core.hpp>

#include <cstdint>

namespace corpuscle {

using Exec = Kokkos::DefaultExecutionSpace;
using Memory = Exec::memory_space;

/// One value per entry.
template <class T>
using Array = Kokkos::View<T*, Kokkos::LayoutRight, Memory>;

/// Components side by side: [entry, component], all entries of one component contiguous.
template <class T>
using Components = Kokkos::View<T**, Kokkos::LayoutLeft, Memory>;

/// Row-wise table: [entry, column], the columns of one entry contiguous.
template <class T>
using Table = Kokkos::View<T**, Kokkos::LayoutRight, Memory>;

using Policy = Kokkos::RangePolicy<Exec>;

/// Uninitialised labelled allocation; every view in the program carries a label "corpuscle::module::name".
inline auto uninitialised(const std::string& label) {
  return Kokkos::view_alloc(label, Kokkos::WithoutInitializing);
}

}  // namespace corpuscle
