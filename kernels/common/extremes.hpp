// Extremes that keep what is not a number. std::max, Kokkos::Max and MPI_MAX lose it, or not, by the order of their arguments:
// a field that has blown up would pass for a small one.
#pragma once

#include <Kokkos_Core.hpp>

namespace corpuscle {

/// The larger of two numbers; not a number if either is not.
KOKKOS_INLINE_FUNCTION double larger(double a, double b) { return a > b || a != a ? a : b; }
/// The smaller of two numbers; not a number if either is not.
KOKKOS_INLINE_FUNCTION double smaller(double a, double b) { return a < b || a != a ? a : b; }

/// Reducer, in the place of Kokkos::Max and Kokkos::Min. The loop's body must use larger() or smaller() too: what one thread
/// sees is never joined.
template <bool largest>
class Extreme {
 public:
  using reducer = Extreme;
  using value_type = double;
  using result_view_type = Kokkos::View<double, Kokkos::HostSpace>;

  KOKKOS_INLINE_FUNCTION explicit Extreme(double& value) : value_(&value) {}

  KOKKOS_INLINE_FUNCTION void join(double& into, const double& from) const { into = largest ? larger(into, from) : smaller(into, from); }
  // Kokkos 3 joins partial results through volatile references.
  KOKKOS_INLINE_FUNCTION void join(volatile double& into, const volatile double& from) const {
    into = largest ? larger(into, from) : smaller(into, from);
  }
  KOKKOS_INLINE_FUNCTION void init(double& value) const {
    value = largest ? Kokkos::reduction_identity<double>::max() : Kokkos::reduction_identity<double>::min();
  }
  KOKKOS_INLINE_FUNCTION double& reference() const { return *value_.data(); }
  KOKKOS_INLINE_FUNCTION result_view_type view() const { return value_; }
  KOKKOS_INLINE_FUNCTION bool references_scalar() const { return true; }

 private:
  result_view_type value_;
};

using Largest = Extreme<true>;
using Smallest = Extreme<false>;

}  // namespace corpuscle
