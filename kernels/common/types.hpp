// Spaces, views and index types shared by every kernel.
#pragma once

#include <Kokkos_Core.hpp>

#include <cstdint>
#include <utility>

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

/// What Kokkos::create_mirror_view returns; the name of the view's own member type depends on the version of Kokkos.
template <class View>
using HostMirror = decltype(Kokkos::create_mirror_view(std::declval<const View&>()));

using Policy = Kokkos::RangePolicy<Exec>;

/// Uninitialised labelled allocation; every view in the program carries a label "corpuscle::module::name".
inline auto uninitialised(const std::string& label) {
  return Kokkos::view_alloc(label, Kokkos::WithoutInitializing);
}

}  // namespace corpuscle
