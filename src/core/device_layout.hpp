// Whether host and device agree on what a kernel is given.
#pragma once

namespace corpuscle {

/// Launch a kernel that tells what it has been given: a view, and a number behind it. nvcc 12.9 and 13 lay out what is marked
/// [[no_unique_address]] otherwise in device code than the host's compiler does (Kokkos pull request 8615), and a view of Kokkos
/// 4.6 to 5.0 may be so marked: kernels then read beside their arguments. Nothing where kernels run on the host.
/// @throws InputError  they do not agree; names the compiler, Kokkos and the remedy
void check_device_layout();

}  // namespace corpuscle
