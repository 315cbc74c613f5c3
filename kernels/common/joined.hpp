// Results of a reduction that join with each other.
#pragma once

#include <Kokkos_Core.hpp>

namespace corpuscle {

/// What Kokkos asks of such a result, from its own join(other) volatile.
template <class Result>
struct Joined {
  KOKKOS_INLINE_FUNCTION Result& operator+=(const Result& b) {
    static_cast<Result*>(this)->join(b);
    return *static_cast<Result*>(this);
  }
  // Kokkos 3 joins partial results through volatile references.
  KOKKOS_INLINE_FUNCTION void operator+=(const volatile Result& b) volatile { static_cast<volatile Result*>(this)->join(b); }
};

}  // namespace corpuscle
