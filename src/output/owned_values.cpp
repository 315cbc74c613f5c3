#include "output/owned_values.hpp"

namespace corpuscle {

namespace {

template <class T>
using Buffer = Kokkos::View<T*, Memory>;

template <class T>
std::vector<T> to_vector(const Buffer<T>& buffer) {
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), buffer);
  return {host.data(), host.data() + host.extent(0)};
}

template <class T>
Buffer<T> to_buffer(const std::vector<T>& values) {
  Buffer<T> buffer(uninitialised("corpuscle::output::buffer"), values.size());
  const Kokkos::View<const T*, Kokkos::HostSpace, Kokkos::MemoryUnmanaged> host(values.data(), values.size());
  Kokkos::deep_copy(buffer, host);
  return buffer;
}

}  // namespace

std::vector<double> box_values(const IndexSpace& index, const CellBox& box, const Array<double>& field) {
  const Buffer<double> buffer(uninitialised("corpuscle::output::buffer"), box.size());
  gather_box(index, box, field, buffer);
  return to_vector(buffer);
}

std::vector<double> interleaved(const IndexSpace& index, const CellBox& box, const Components<double>& field) {
  const Buffer<double> buffer(uninitialised("corpuscle::output::buffer"), 3 * box.size());
  gather_vectors(index, box, field, buffer);
  return to_vector(buffer);
}

std::vector<std::int64_t> box_integers(const IndexSpace& index, const CellBox& box, const Array<NodeKind>& kind) {
  const Buffer<std::int64_t> buffer(uninitialised("corpuscle::output::buffer"), box.size());
  for_box_positions(
      "corpuscle::output::gather_kinds", index, box, KOKKOS_LAMBDA(int e, int c) { buffer(e) = static_cast<std::int64_t>(kind(c)); });
  return to_vector(buffer);
}

void set_box_values(const IndexSpace& index, const CellBox& box, const std::vector<double>& values, const Array<double>& field) {
  scatter_box(index, box, to_buffer(values), field);
}

void set_interleaved(const IndexSpace& index, const CellBox& box, const std::vector<double>& values, const Components<double>& field) {
  scatter_vectors(index, box, to_buffer(values), field);
}

std::vector<double> vertex_values(int count, const Components<double>& field) {
  const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), field);
  std::vector<double> values(3 * static_cast<std::size_t>(count));
  for (int v = 0; v < count; ++v)
    for (int m = 0; m < 3; ++m) values[3 * v + m] = host(v, m);
  return values;
}

}  // namespace corpuscle
