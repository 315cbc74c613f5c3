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

/// A device view and its copy on the host, allocated once: for what the host reads every step. Where the host can reach
/// the view they are the same.
template <class View>
class HostCopy {
 public:
  HostCopy() = default;
  explicit HostCopy(const View& view) : view_(view), host_(Kokkos::create_mirror_view(view)) {}

  /// The view's present values.
  const HostMirror<View>& read() const {
    Kokkos::deep_copy(host_, view_);
    return host_;
  }
  /// Puts back what was changed in the copy.
  void write() const { Kokkos::deep_copy(view_, host_); }
  /// Of a view of one value.
  template <class Value>
  void set(const Value& value) const {
    host_() = value;
    write();
  }
  bool is_of(const View& view) const { return view.data() == view_.data() && view.size() == view_.size(); }

 private:
  View view_;
  HostMirror<View> host_;
};

#if defined(KOKKOS_ENABLE_CUDA) || defined(KOKKOS_ENABLE_HIP)
/// Loops run on the device alone. A lambda for both sides would be kept by the host behind pointers that each translation unit sets for
/// itself: in a header's loop that several share, the linker keeps one function, and it may not find its own.
#undef KOKKOS_LAMBDA
#define KOKKOS_LAMBDA [=] __device__
#define CORPUSCLE_DEVICE_FUNCTION __device__
/// What a loop holds goes along with its launch, up to 4 kB. Kokkos would put more than 512 bytes into constant memory, of which
/// there is one: each launch would wait until the one before has ended.
using WithLaunch = Kokkos::Experimental::WorkItemProperty::HintLightWeight_t;
using Policy = Kokkos::RangePolicy<Exec, WithLaunch>;
#else
#define CORPUSCLE_DEVICE_FUNCTION
using Policy = Kokkos::RangePolicy<Exec>;
#endif

/// Uninitialised labelled allocation; every view in the program carries a label "corpuscle::module::name".
inline auto uninitialised(const std::string& label) { return Kokkos::view_alloc(label, Kokkos::WithoutInitializing); }

}  // namespace corpuscle
