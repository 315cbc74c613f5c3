// Items sorted into bins: a counting sort whose result does not depend on who counts first.
#pragma once

#include <string>

#include "common/summing.hpp"

namespace corpuscle {

/// Items 0 to count - 1 by bin, and in each bin in the order of their numbers.
/// @param label  of the step, as "corpuscle::module::step"; its kernels' names begin with it
/// @param bin    bin(item), or negative for an item that is left out; called several times for each
/// @param start  [bin + 1] first of `order` in each bin
/// @param order  [item] room for all items
template <class Bin>
void counting_sort(const std::string& label, int count, int bins, const Bin& bin, const Array<int>& start, const Array<int>& order) {
  Kokkos::deep_copy(Exec(), start, 0);
  Kokkos::parallel_for(
      label + "_count", Policy(0, count), KOKKOS_LAMBDA(int item) {
        const int b = bin(item);
        if (b >= 0) Kokkos::atomic_fetch_add(&start(b), 1);
      });
  // To the end of each bin; placing the items counts it down to the start.
  start_running_sum<int>(
      label + "_ends", bins + 1, KOKKOS_LAMBDA(int b, int& sum, bool last) {
        sum += start(b);
        if (last) start(b) = sum;
      });
  Kokkos::parallel_for(
      label + "_place", Policy(0, count), KOKKOS_LAMBDA(int item) {
        const int b = bin(item);
        if (b >= 0) order(Kokkos::atomic_fetch_add(&start(b), -1) - 1) = item;
      });
  Kokkos::parallel_for(
      label + "_order", Policy(0, bins), KOKKOS_LAMBDA(int b) {
        const int begin = start(b), end = start(b + 1);
        for (int i = begin + 1; i < end; ++i) {
          const int moved = order(i);
          int to = i;
          for (; to > begin && order(to - 1) > moved; --to) order(to) = order(to - 1);
          order(to) = moved;
        }
      });
}

}  // namespace corpuscle
