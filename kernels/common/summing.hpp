// Running sums and sums over teams whose loops tell the type of what they sum: from a lambda for a device alone Kokkos cannot see it.
#pragma once

#include <string>
#include <utility>

#include "common/types.hpp"

namespace corpuscle {

template <class Value, class Body>
struct Summing {
  using value_type = Value;
  Body body;

  template <class... Arguments>
  CORPUSCLE_DEVICE_FUNCTION void operator()(Arguments&&... arguments) const {
    body(std::forward<Arguments>(arguments)...);
  }
};

/// Kokkos::parallel_scan over 0 to count - 1. @param body  body(i, sum, last)  @returns the sum of all
template <class Value, class Body>
Value running_sum(const std::string& label, int count, const Body& body) {
  Value total = 0;
  Kokkos::parallel_scan(label, Policy(0, count), Summing<Value, Body>{body}, total);
  return total;
}

/// The same, without waiting for the sum of all.
template <class Value, class Body>
void start_running_sum(const std::string& label, int count, const Body& body) {
  Kokkos::parallel_scan(label, Policy(0, count), Summing<Value, Body>{body});
}

/// Kokkos::parallel_reduce over teams, into `result`. @param body  body(team, value)
template <class Value, class Body, class Result>
void reduce_teams(const std::string& label, int teams, const Body& body, const Result& result) {
  Kokkos::parallel_reduce(label, Kokkos::TeamPolicy<Exec>(teams, Kokkos::AUTO), Summing<Value, Body>{body}, result);
}

}  // namespace corpuscle
