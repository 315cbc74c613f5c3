#include "cells/shared_cells.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "cells/cell_boxes.hpp"
#include "core/error.hpp"
#include "coupling/periodic_frame.hpp"
#include "immersed/surface.hpp"
#include "parallel/agree.hpp"

namespace corpuscle {

namespace {

/// Every how many steps cells may come back through sides or change their rank. When they do must not depend on when copies
/// were made, or a restart would not go on with the same bits.
constexpr long review_every = 16;

/// Those that are further beyond a side than this share of the period come back at once, or they would be needed under more images
/// than these: as many periods each way.
constexpr double far_share = 0.125;
constexpr int most_turns = 2;

/// Of a copy, as its rank is told of it.
struct Notice {
  int type, number, image;
};

Vec3 to_vec3(const Triple& a) { return {a[0], a[1], a[2]}; }

SpaceBox box_of(const HostMirror<Table<double>>& boxes, int cell, double margin) {
  SpaceBox box;
  for (int d = 0; d < 3; ++d) {
    box.lower[d] = boxes(cell, BoxColumn::lower + d) - margin;
    box.upper[d] = boxes(cell, BoxColumn::upper + d) + margin;
  }
  return box;
}

}  // namespace

SharedCells::SharedCells(const CellPlaces& places, const Grid& grid, int layers, double contact_um, std::shared_ptr<Workspace> workspace)
    : comm_(grid.comm()),
      blocks_(grid, layers),
      shift_turns_(period_turns(grid, most_turns)),
      shifts_(period_shifts(grid, most_turns)),
      frame_(periodic_frame(grid)),
      skin_(grid.mean_spacing()),
      contact_(contact_um) {
  membranes_ = std::make_unique<Membranes>(places.types, std::move(workspace));
  membranes_->call(places.names);
  start(places);
}

/// Each rank takes those in its block and makes their meshes.
void SharedCells::start(const CellPlaces& places) {
  std::vector<CellRecord> mine;
  std::vector<double> carried;
  for (std::size_t c = 0; c < places.cells.size(); ++c) {
    const CellPlace& place = places.cells[c];
    CellRecord cell;
    cell.type = place.type;
    cell.number = static_cast<int>(c);
    cell.first_vertex = total_vertices_;
    cell.first_triangle = total_triangles_;
    total_vertices_ += vertices_of(cell.type);
    total_triangles_ += triangles_of(cell.type);
    if (blocks_.owner(to_vec3(place.center_um)) != comm_.rank()) continue;
    mine.push_back(cell);
    TriangleMesh mesh = stretched(places.types[cell.type].mesh, place.start_stretch);
    if (cell.number >= places.names.listed && places.size != 1)
      for (Triple& x : mesh.vertices)
        for (double& component : x) component *= places.size;
    for (const Triple& x : transform(mesh, place.axis, place.spin_deg, place.center_um).vertices) {
      carried.insert(carried.end(), x.begin(), x.end());
      carried.insert(carried.end(), 3 * (membranes_->carried().size() - 1), 0.0);
    }
  }
  total_ = static_cast<int>(places.cells.size());
  own_ = mine;
  set_own(carried);
  measure(0);
  Kokkos::deep_copy(boxes_host_, boxes_);
  if (wrap(0)) {  // a case may have cells anywhere beyond its periodic sides
    measure(0);
    Kokkos::deep_copy(boxes_host_, boxes_);
  }
  settle(owners());
}

Triple SharedCells::wrapped_by(const CellRecord& cell) const {
  Triple shift{};
  for (int d = 0; d < 3; ++d)
    for (int m = 0; m < 3; ++m) shift[m] += cell.laps[d] * frame_.period[d][m];
  return shift;
}

void SharedCells::measure(double ahead_us) {
  const auto cells = own_.size();
  if (!boxes_.data() || boxes_.extent(0) < cells) {
    boxes_ = Table<double>(uninitialised("corpuscle::cells::boxes"), cells + cells / 10 + 1, BoxColumn::count);
    before_ = Table<double>(uninitialised("corpuscle::cells::boxes_before"), boxes_.extent(0), BoxColumn::count);
    boxes_host_ = Kokkos::create_mirror_view(boxes_);
  }
  if (cells > 0) measure_boxes(surfaces(), static_cast<int>(cells), ahead_us, boxes_);
}

bool SharedCells::begin_step(double ahead_us) {
  const bool review = steps_++ % review_every == 0;
  measure(ahead_us);
  const Departures departures = find_departures(static_cast<int>(own_.size()), boxes_, before_, skin_, frame_, far_share);
  bool moved = false;
  if (review || departures.mean) {
    Kokkos::deep_copy(boxes_host_, boxes_);
    moved = wrap(review ? 0 : far_share);
    if (moved) measure(ahead_us);
    Kokkos::deep_copy(boxes_host_, boxes_);
  }
  const std::vector<int> owner = review ? owners() : std::vector<int>();
  const bool leaving = std::any_of(owner.begin(), owner.end(), [this](int rank) { return rank != comm_.rank(); });
  double change[2] = {leaving ? 1.0 : 0.0, moved || departures.box ? 1.0 : 0.0};
  comm_.max(change, 2);
  if (change[0] + change[1] == 0) return false;
  if (change[0] > 0) distribute(owner);
  measure(ahead_us);
  renew_copies();
  return true;
}

/// Own cells whose vertices' mean lies outside the domain, by a share of the period, come back at its other end. After measure(),
/// with boxes_host_.
bool SharedCells::wrap(double share) {
  bool any = false;
  std::vector<Vec3> by(own_.size());
  for (std::size_t c = 0; c < own_.size(); ++c) {
    const Vec3 mean{boxes_host_(c, BoxColumn::mean), boxes_host_(c, BoxColumn::mean + 1), boxes_host_(c, BoxColumn::mean + 2)};
    for (int d = 0; d < 3; ++d) {
      if (!frame_.periodic[d]) continue;
      const double along = periods_from_origin(frame_, mean, d), turns = std::floor(along);
      const bool within = along >= -share && along < 1 + share;
      if (within || !std::isfinite(turns)) continue;
      any = true;
      own_[c].laps[d] += static_cast<int>(turns);
      by[c] += turns * frame_.period[d];
    }
  }
  if (!any) return false;
  ++moves_;
  const Table<double> shift(uninitialised("corpuscle::cells::shift"), own_.size(), 3);
  const auto host = Kokkos::create_mirror_view(shift);
  for (std::size_t c = 0; c < own_.size(); ++c)
    for (int d = 0; d < 3; ++d) host(c, d) = by[c][d];
  Kokkos::deep_copy(shift, host);
  shift_cells(surfaces(), surfaces().own_vertices, shift);
  return true;
}

/// By their places. After measure(), with boxes_host_.
std::vector<int> SharedCells::owners() const {
  std::vector<int> owner;
  for (std::size_t c = 0; c < own_.size(); ++c)
    owner.push_back(
        blocks_.owner({boxes_host_(c, BoxColumn::mean), boxes_host_(c, BoxColumn::mean + 1), boxes_host_(c, BoxColumn::mean + 2)}));
  return owner;
}

std::vector<double> SharedCells::carried() const {
  const auto fields = membranes_->carried();
  const std::size_t width = 3 * fields.size();
  std::vector<double> values(width * surfaces().own_vertices);
  for (std::size_t f = 0; f < fields.size(); ++f) {
    const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), fields[f]);
    for (int i = 0; i < surfaces().own_vertices; ++i)
      for (int d = 0; d < 3; ++d) values[width * i + 3 * f + d] = host(i, d);
  }
  return values;
}

void SharedCells::restore(const std::vector<CellRecord>& cells, const std::vector<double>& carried, const std::vector<int>& owners,
                          long steps) {
  own_ = cells;
  set_own(carried);
  measure(0);
  Kokkos::deep_copy(boxes_host_, boxes_);
  steps_ = steps;
  settle(owners.empty() ? this->owners() : owners);
}

/// Cells at hand go to their ranks for the first time.
void SharedCells::settle(const std::vector<int>& owners) {
  distribute(owners);
  measure(0);
  try {
    renew_copies();
  } catch (const ComputationError& error) {  // before a step it is the input that is wrong
    throw InputError(error.what());
  }
}

/// Holds own_, which carry this, without copies.
void SharedCells::set_own(const std::vector<double>& carried) {
  std::vector<HeldCell> held;
  for (const CellRecord& cell : own_) held.push_back({cell.type, cell.number});
  membranes_->hold(held, static_cast<int>(held.size()));
  const auto fields = membranes_->carried();
  const std::size_t width = 3 * fields.size();
  for (std::size_t f = 0; f < fields.size(); ++f) {
    const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), fields[f]);
    for (int i = 0; i < surfaces().own_vertices; ++i)
      for (int d = 0; d < 3; ++d) host(i, d) = carried[width * i + 3 * f + d];
    Kokkos::deep_copy(fields[f], host);
  }
}

/// Cells go to their owners, with all that is theirs. @param owners  [own cell]
void SharedCells::distribute(const std::vector<int>& owners) {
  ++moves_;
  const std::vector<double> values = carried();
  const std::size_t width = 3 * membranes_->carried().size();
  Parcels parcels;
  std::size_t at = 0;
  for (std::size_t c = 0; c < own_.size(); ++c) {
    const std::size_t count = width * vertices_of(own_[c].type);
    put(parcels[owners[c]], &own_[c], 1);
    put(parcels[owners[c]], values.data() + at, count);
    at += count;
  }
  const Parcels arrived = exchange_parcels(comm_, parcels);
  struct Arrival {
    CellRecord cell;
    const std::vector<char>* bytes;
    std::size_t at;
  };
  std::vector<Arrival> arrivals;
  for (const auto& [rank, bytes] : arrived)
    for (std::size_t n = 0; n < bytes.size();) {
      Arrival one{{}, &bytes, 0};
      one.at = take(bytes, n, &one.cell, 1);
      n = one.at + width * vertices_of(one.cell.type) * sizeof(double);
      arrivals.push_back(one);
    }
  std::sort(arrivals.begin(), arrivals.end(), [](const Arrival& a, const Arrival& b) { return a.cell.number < b.cell.number; });
  own_.clear();
  std::vector<double> carried;
  for (const Arrival& one : arrivals) {
    own_.push_back(one.cell);
    const std::size_t begin = carried.size();
    carried.resize(begin + width * vertices_of(one.cell.type));
    take(*one.bytes, one.at, carried.data() + begin, carried.size() - begin);
  }
  set_own(carried);
}

/// Of every rank, the box around its own cells; none without contact. After measure(), with boxes_host_.
std::vector<SpaceBox> SharedCells::find_reach() const {
  std::vector<SpaceBox> reach;
  if (contact_ == 0) return reach;
  std::vector<double> all(6 * static_cast<std::size_t>(blocks_.ranks()), 0.0);
  double* mine = all.data() + 6 * static_cast<std::size_t>(comm_.rank());
  for (int d = 0; d < 3; ++d) mine[d] = 1e300, mine[3 + d] = -1e300;
  for (std::size_t c = 0; c < own_.size(); ++c) {
    const SpaceBox box = box_of(boxes_host_, static_cast<int>(c), skin_);
    for (int d = 0; d < 3; ++d) {
      mine[d] = std::min(mine[d], box.lower[d]);
      mine[3 + d] = std::max(mine[3 + d], box.upper[d]);
    }
  }
  comm_.sum(all.data(), static_cast<int>(all.size()));
  for (std::size_t n = 0; n < all.size(); n += 6) reach.push_back({{all[n], all[n + 1], all[n + 2]}, {all[n + 3], all[n + 4], all[n + 5]}});
  return reach;
}

/// Of a cell that would be seen under images beyond those that there are. @param around  all places where anything looks for it
std::string SharedCells::unseen_images(const SpaceBox& around, int cell) const {
  const SpaceBox box = box_of(boxes_host_, cell, skin_ + contact_);
  constexpr double next = most_turns + 1;
  for (int d = 0; d < 3; ++d) {
    if (!frame_.periodic[d]) continue;
    double apart = 0, half = 0;  // periods, of the boxes' middles, and half their lengths together
    for (int m = 0; m < 3; ++m) {
      apart += 0.5 * frame_.dual[d][m] * (box.lower[m] + box.upper[m] - around.lower[m] - around.upper[m]);
      half += 0.5 * std::abs(frame_.dual[d][m]) * (box.upper[m] - box.lower[m] + around.upper[m] - around.lower[m]);
    }
    if (next - std::abs(apart) <= half)
      return fmt::format(
          "{} reaches over too many periods of the grid along {}, of {:.3g} um: it meets more than {} images of itself "
          "each way. Likely cause: a grid too short for the cell, or, in a run, a step too long for the flow: lengthen the "
          "grid (grid.upper_um, grid.length_um), or reduce time.step_us",
          body_name(surfaces(), cell), "ijk"[d], norm(frame_.period[d]), most_turns);
  }
  return "";
}

/// After measure().
void SharedCells::renew_copies() {
  ++renewals_;
  Kokkos::deep_copy(boxes_host_, boxes_);
  Kokkos::deep_copy(before_, boxes_);
  const std::vector<SpaceBox> reach = find_reach();
  SpaceBox around = blocks_.whole();
  for (const SpaceBox& one : reach) around = joined(around, one);
  std::string unseen;
  for (std::size_t c = 0; c < own_.size() && unseen.empty(); ++c) unseen = unseen_images(around, static_cast<int>(c));
  unseen = agree(comm_, unseen);
  if (!unseen.empty()) throw ComputationError(unseen);
  std::map<int, std::vector<CopyMessages::Copy>> wanted;
  Parcels notices;
  for (std::size_t c = 0; c < own_.size(); ++c) {
    const SpaceBox box = box_of(boxes_host_, static_cast<int>(c), skin_ + contact_);
    for (std::size_t image = 0; image < shifts_.size(); ++image) {
      const SpaceBox seen{box.lower + shifts_[image], box.upper + shifts_[image]};
      if (!overlap(seen, around)) continue;
      for (int rank = 0; rank < blocks_.ranks(); ++rank) {
        if (image == 0 && rank == comm_.rank()) continue;
        if (!blocks_.reaches(seen, rank) && !(contact_ > 0 && overlap(seen, reach[rank]))) continue;
        const Notice notice{own_[c].type, own_[c].number, static_cast<int>(image)};
        put(notices[rank], &notice, 1);
        wanted[rank].push_back({rank, static_cast<int>(c), vertices_of(own_[c].type), static_cast<int>(image), shifts_[image]});
      }
    }
  }
  std::vector<CopyMessages::Copy> sent, received;
  for (const auto& [rank, copies] : wanted) sent.insert(sent.end(), copies.begin(), copies.end());
  std::vector<Notice> told;
  for (const auto& [rank, bytes] : exchange_parcels(comm_, notices))
    for (std::size_t n = 0; n < bytes.size();) {
      Notice notice;
      n = take(bytes, n, &notice, 1);
      told.push_back(notice);
      received.push_back({rank, 0, vertices_of(notice.type), notice.image, {}});
    }
  // Copies stand in an order that does not depend on whose they are.
  std::vector<int> order(told.size());
  for (std::size_t n = 0; n < order.size(); ++n) order[n] = static_cast<int>(n);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::make_pair(told[a].number, told[a].image) < std::make_pair(told[b].number, told[b].image); });
  std::vector<HeldCell> held;
  for (const CellRecord& cell : own_) held.push_back({cell.type, cell.number});
  for (int n : order) {
    received[n].cell = static_cast<int>(held.size());
    held.push_back({told[n].type, told[n].number});
  }
  membranes_->hold(held, static_cast<int>(own_.size()));
  messages_.set(comm_, sent, received);
  note_turns(received);
}

void SharedCells::note_turns(const std::vector<CopyMessages::Copy>& received) {
  const auto bodies = static_cast<std::size_t>(surfaces().bodies);
  if (!turns_.data() || turns_.extent(0) < bodies)
    turns_ = Table<int>(uninitialised("corpuscle::cells::turns"), bodies + bodies / 10 + 1, 3);
  const auto turns = Kokkos::create_mirror_view(turns_);
  Kokkos::deep_copy(turns, 0);
  for (const CopyMessages::Copy& copy : received)
    for (int d = 0; d < 3; ++d) turns(copy.cell, d) = shift_turns_[copy.image][d];
  Kokkos::deep_copy(turns_, turns);
}

void SharedCells::to_copies(const Components<double>& field, bool positions) { messages_.to_copies(surfaces(), field, positions); }

void SharedCells::add_copies(const Components<double>& field) { messages_.add_copies(surfaces(), field); }

}  // namespace corpuscle
