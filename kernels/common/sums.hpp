// Several sums in one reduction.
#pragma once

#include "common/types.hpp"

namespace corpuscle {

template <int n>
struct Sums {
  double value[n] = {};

  KOKKOS_INLINE_FUNCTION double& operator[](int i) { return value[i]; }
  KOKKOS_INLINE_FUNCTION double operator[](int i) const { return value[i]; }
  KOKKOS_INLINE_FUNCTION Sums& operator+=(const Sums& b) {
    for (int i = 0; i < n; ++i) value[i] += b.value[i];
    return *this;
  }
  // Kokkos 3 joins partial results through volatile references.
  KOKKOS_INLINE_FUNCTION void operator+=(const volatile Sums& b) volatile {
    for (int i = 0; i < n; ++i) value[i] = value[i] + b.value[i];
  }
};

}  // namespace corpuscle

/// What Kokkos needs of a type to sum it.
namespace Kokkos {
template <int n>
struct reduction_identity<corpuscle::Sums<n>> {
  KOKKOS_FORCEINLINE_FUNCTION static corpuscle::Sums<n> sum() { return {}; }
};
}  // namespace Kokkos
