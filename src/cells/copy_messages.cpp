#include "cells/copy_messages.hpp"

#include <algorithm>
#include <string>
#include <tuple>

#include "parallel/traffic.hpp"

namespace corpuscle {

namespace {

auto label(const char* name) { return uninitialised(std::string("corpuscle::cells::") + name); }

template <class View>
void upload(View& view, const char* name, const std::vector<int>& values) {
  if (!view.data() || view.extent(0) < values.size()) view = View(label(name), values.size() + values.size() / 10 + 1);
  const auto part = Kokkos::subview(view, std::make_pair(std::size_t(0), values.size()));
  const auto host = Kokkos::create_mirror_view(part);
  std::copy(values.begin(), values.end(), host.data());
  Kokkos::deep_copy(part, host);
}

auto rows(const Table<double>& table, int first, int count) {
  return Kokkos::subview(table, std::make_pair(first, first + count), Kokkos::ALL);
}

}  // namespace

void CopyMessages::set(const Comm& comm, const std::vector<Copy>& sent, const std::vector<Copy>& received) {
  comm_ = comm;
  set_side(sent, outgoing_);
  set_side(received, incoming_);
  set_parts(sent);
}

void CopyMessages::set_side(const std::vector<Copy>& copies, Side& side) {
  std::vector<int> cell, first{0};
  side.segments.clear();
  for (const Copy& copy : copies) {
    if (side.segments.empty() || side.segments.back().rank != copy.rank) side.segments.push_back({copy.rank, first.back(), 0});
    side.segments.back().count += copy.vertices;
    cell.push_back(copy.cell);
    first.push_back(first.back() + copy.vertices);
  }
  side.vertices = first.back();
  side.parcels.count = static_cast<int>(copies.size());
  upload(side.parcels.cell, "parcel_cell", cell);
  upload(side.parcels.first, "parcel_first", first);
  if (!side.parcels.shift.data() || side.parcels.shift.extent(0) < copies.size())
    side.parcels.shift = Table<double>(label("parcel_shift"), copies.size() + copies.size() / 10 + 1, 3);
  const auto shift = Kokkos::create_mirror_view(side.parcels.shift);
  for (std::size_t n = 0; n < copies.size(); ++n)
    for (int d = 0; d < 3; ++d) shift(n, d) = copies[n].shift[d];
  Kokkos::deep_copy(side.parcels.shift, shift);
  if (!side.message.data() || side.message.extent(0) < static_cast<std::size_t>(side.vertices)) {
    side.message = Table<double>();
    side.message = Table<double>(label("message"), side.vertices + side.vertices / 10 + 1, 3);
    side.host = Kokkos::create_mirror_view(side.message);
  }
}

/// Of each cell with copies, they and what it finds itself, in the order of ranks and images, which does not depend on whose
/// the cell is.
void CopyMessages::set_parts(const std::vector<Copy>& sent) {
  std::vector<std::tuple<int, int, int, int>> parts;  // cell, rank, image, from
  int first = 0;
  for (const Copy& copy : sent) {
    parts.emplace_back(copy.cell, copy.rank, copy.image, first);
    first += copy.vertices;
  }
  const std::size_t copies = parts.size();
  for (std::size_t n = 0; n < copies; ++n) parts.emplace_back(std::get<0>(parts[n]), comm_.rank(), 0, -1);
  std::sort(parts.begin(), parts.end());
  parts.erase(std::unique(parts.begin(), parts.end()), parts.end());
  std::vector<int> cell, first_part, from;
  for (const auto& part : parts) {
    if (cell.empty() || cell.back() != std::get<0>(part)) {
      cell.push_back(std::get<0>(part));
      first_part.push_back(static_cast<int>(from.size()));
    }
    from.push_back(std::get<3>(part));
  }
  first_part.push_back(static_cast<int>(from.size()));
  parts_.count = static_cast<int>(cell.size());
  upload(parts_.cell, "parts_cell", cell);
  upload(parts_.first, "parts_first", first_part);
  upload(parts_.from, "parts_from", from);
}

/// From one side's message to the other's, on whichever ranks they are.
void CopyMessages::pass(const Side& from, const Side& to) const {
  const auto is_own = [this](const Segment& s) { return s.rank == comm_.rank(); };
  [[maybe_unused]] const bool others =
      !std::all_of(from.segments.begin(), from.segments.end(), is_own) || !std::all_of(to.segments.begin(), to.segments.end(), is_own);
#ifdef CORPUSCLE_MPI
  if (others) {
    constexpr int tag = 72;
    std::vector<MPI_Request> requests;
    for (const Segment& s : to.segments)
      if (!is_own(s)) MPI_Irecv(&to.host(s.first, 0), 3 * s.count, MPI_DOUBLE, s.rank, tag, comm_.handle(), &requests.emplace_back());
    Kokkos::deep_copy(from.host, from.message);
    for (const Segment& s : from.segments)
      if (!is_own(s)) {
        traffic().sent(3L * s.count * static_cast<long>(sizeof(double)));
        MPI_Isend(&from.host(s.first, 0), 3 * s.count, MPI_DOUBLE, s.rank, tag, comm_.handle(), &requests.emplace_back());
      }
    MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
    Kokkos::deep_copy(to.message, to.host);
  }
#endif
  const auto a = std::find_if(from.segments.begin(), from.segments.end(), is_own);
  const auto b = std::find_if(to.segments.begin(), to.segments.end(), is_own);
  if (a != from.segments.end() && b != to.segments.end())
    Kokkos::deep_copy(Exec(), rows(to.message, b->first, b->count), rows(from.message, a->first, a->count));
}

void CopyMessages::to_copies(const SurfaceSet& set, const Components<double>& field, bool positions) {
  if (outgoing_.parcels.count > 0) pack_cells(outgoing_.parcels, set.first_vertex, field, positions, outgoing_.message);
  Exec().fence();
  pass(outgoing_, incoming_);
  if (incoming_.parcels.count > 0) unpack_cells(incoming_.parcels, set.first_vertex, incoming_.message, field);
}

void CopyMessages::add_copies(const SurfaceSet& set, const Components<double>& field) {
  if (incoming_.parcels.count > 0) pack_cells(incoming_.parcels, set.first_vertex, field, false, incoming_.message);
  Exec().fence();
  pass(incoming_, outgoing_);
  if (parts_.count > 0) add_parts(parts_, set.first_vertex, outgoing_.message, field);
}

}  // namespace corpuscle
