#include "core/device_layout.hpp"

#include "common/types.hpp"
#include "core/error.hpp"

#include <fmt/format.h>

namespace corpuscle {

void check_device_layout() {
#if defined(KOKKOS_ENABLE_CUDA) || defined(KOKKOS_ENABLE_HIP)
  constexpr int mark = 20261127;
  const Array<int> told("corpuscle::core::told", 2);
  const int extent = static_cast<int>(told.extent(0));
  // A kernel that reads beside its arguments may find no range to run over, or end in an error of the device.
  Kokkos::parallel_for(
      "corpuscle::core::told", Policy(0, extent), KOKKOS_LAMBDA(int i) { told(i) = i == 0 ? mark : int(told.extent(0)) + extent; });
  const auto host = Kokkos::create_mirror_view(told);
  Kokkos::deep_copy(host, told);
  if (host(0) == mark && host(1) == 2 * extent) return;
  throw InputError(fmt::format(
      "build: the device does not see what kernels are given: host and device code disagree on the layout of a Kokkos view. Build with a "
      "Kokkos that leaves [[no_unique_address]] out for this compiler (4.7.2, 5.0 or newer for CUDA 12.9 and 13), or set "
      "Kokkos_ENABLE_IMPL_MDSPAN=OFF; this is Kokkos {}.{}.{}",
      KOKKOS_VERSION / 10000, KOKKOS_VERSION / 100 % 100, KOKKOS_VERSION % 100));
#endif
}

}  // namespace corpuscle
