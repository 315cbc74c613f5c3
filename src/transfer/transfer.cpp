#include "transfer/transfer.hpp"

#include <algorithm>

#include "transfer/delta.hpp"
#include "transfer/marker_bins.hpp"
#include "transfer/sharpen.hpp"
#include "transfer/transfer_kernels.hpp"

namespace corpuscle {

namespace {

template <class View, class... Extents>
View make(const char* name, Extents... extents) {
  return View(uninitialised(std::string("corpuscle::transfer::") + name), extents...);
}

/// All shifts by -1, 0 or +1 period; the identity first.
PeriodImages period_images(const Grid& grid) {
  const IndexSpace& index = grid.index();
  PeriodImages images;
  images.count = 0;
  for (int k = 0; k < 27; ++k) {
    const int step[3] = {(k % 3 + 1) % 3 - 1, (k / 3 % 3 + 1) % 3 - 1, (k / 9 + 1) % 3 - 1};
    Vec3 shift;
    bool allowed = true;
    for (int d = 0; d < 3; ++d) {
      allowed = allowed && (step[d] == 0 || index.periodic[d]);
      for (int m = 0; m < 3; ++m) shift[m] += step[d] * grid.period(d)[m];
      images.turns[images.count][d] = step[d];
    }
    if (allowed) images.shift[images.count++] = shift;
  }
  return images;
}

/// Bounds of the lattice in space, widened by one of its links.
void find_bounds(const Lattice& lattice, MarkerSearch& search) {
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), lattice.x);
  double link = 0;
  search.lower = {1e300, 1e300, 1e300};
  search.upper = {-1e300, -1e300, -1e300};
  for (int k = lattice.lower[2]; k <= lattice.upper[2]; ++k)
    for (int j = lattice.lower[1]; j <= lattice.upper[1]; ++j)
      for (int i = lattice.lower[0]; i <= lattice.upper[0]; ++i) {
        const int at[3] = {i, j, k}, c = lattice.node(i, j, k);
        const Vec3 p = load(x, c);
        for (int d = 0; d < 3; ++d) {
          search.lower[d] = std::min(search.lower[d], p[d]);
          search.upper[d] = std::max(search.upper[d], p[d]);
          if (at[d] < lattice.upper[d]) link = std::max(link, norm(load(x, c + lattice.index.stride(d)) - p));
        }
      }
  search.lower -= {link, link, link};
  search.upper += {link, link, link};
}

void set_reflections(const std::vector<BoundarySettings>& boundaries, TransferBlock& block) {
  using Type = BoundarySettings::Type;
  for (const auto& boundary : boundaries) {
    auto& reflection = block.reflection[static_cast<int>(boundary.side) / 2][static_cast<int>(boundary.side) % 2];
    const bool derivative = boundary.type == Type::outflow || boundary.type == Type::symmetry;
    reflection[0] = derivative ? 1 : -1;
    reflection[1] = boundary.type == Type::outflow ? 1 : -1;
  }
}

}  // namespace

template <class Use>
void Transfer::with_kernel(const Use& use) const {
  if (kernel_ == CouplingSettings::Kernel::four_point)
    use(FourPointDelta());
  else
    use(ThreePointDelta());
}

Transfer::Transfer(Grid& grid, const std::vector<BoundarySettings>& boundaries, CouplingSettings::Kernel kernel, int vertices)
    : grid_(&grid), kernel_(kernel) {
  const GridViews& views = grid.views();
  const int cells = views.index.size();
  block_.lattice = make_lattice(views);
  for (int d = 0; d < 3; ++d) {
    block_.area[d] = views.face_area[d];
    faces_.across[d] = Array<double>("corpuscle::transfer::across", cells);
    block_.sharp_area[d] = views.face_area[d];
  }
  with_kernel([&](auto delta) { moment_ = decltype(delta)::moment; });
  if (moment_ > 0) prepare_sharpening();
  set_reflections(boundaries, block_);
  search_.lattice = block_.lattice;
  search_.images = period_images(grid);
  find_bounds(block_.lattice, search_);
  with_kernel([&](auto delta) { search_.reach = decltype(delta)::reach; });
  places_ = {make<Table<double>>("vertex_xi", vertices, 3), make<Array<int>>("vertex_image", vertices),
             make<Array<unsigned>>("vertex_reach", vertices), make<Array<int>>("vertex_first", vertices + 1),
             make<Array<int>>("beyond", 1)};
  Kokkos::deep_copy(places_.image, -1);
  beyond_host_ = HostCopy(places_.beyond);
  markers_.start = make<Array<int>>("cell_start", cells + 1);
  markers_.near = make<Array<unsigned char>>("cell_near", cells);
  make_room(vertices);
}

void Transfer::make_room(int markers) {
  if (markers <= room_) return;
  room_ = markers + markers / 10;
  int points = 0;
  with_kernel([&](auto delta) { points = decltype(delta)::points; });
  markers_.vertex = make<Array<int>>("marker_vertex", room_);
  markers_.home = make<Array<unsigned char>>("marker_home", room_);
  markers_.eta = make<Table<double>>("marker_eta", room_, 3);
  markers_.base = make<Table<short>>("marker_base", room_, 6);
  markers_.weight = make<Table<double>>("marker_weight", room_, 6 * points);
  markers_.inverse = make<Table<double>>("marker_inverse", room_, 9);
  markers_.across = make<Table<double>>("marker_across", room_, 3);
  markers_.velocity = make<Components<double>>("marker_velocity", room_, 3);
  markers_.order = make<Array<int>>("marker_order", room_);
}

int Transfer::place(const Components<double>& x) {
  find_images(search_, x, places_);
  markers_.count = number_markers(places_);
  make_room(markers_.count);
  fill_markers(search_, x, places_, markers_);
  sort_markers(block_.index(), markers_);
  with_kernel([&](auto delta) {
    prepare_markers<decltype(delta)>(block_, markers_);
    mark_near<decltype(delta)>(block_, markers_);
  });
  const int beyond = beyond_host_.read()(0);
  return beyond < no_vertex ? beyond : -1;
}

/// Areas of the faces as the kernel sees them; the faces' own where that changes nothing, on uniform grids.
void Transfer::prepare_sharpening() {
  const IndexSpace& index = block_.index();
  double most = 0;
  Components<double> sharp[3];
  for (int d = 0; d < 3; ++d) {
    raw_[d] = Array<double>("corpuscle::transfer::raw_face", index.size());
    sharp_flux_[d] = Array<double>("corpuscle::transfer::sharp_flux", index.size());
    sharp[d] = Components<double>("corpuscle::transfer::sharp_area", index.size(), 3);
    for (int m = 0; m < 3; ++m)
      sharpen_faces(block_.lattice, d, moment_, false, Kokkos::subview(block_.area[d], Kokkos::ALL, m),
                    Kokkos::subview(sharp[d], Kokkos::ALL, m));
    grid_->halo().exchange(sharp[d]);
    most = std::max(most, largest_difference(index, d, block_.area[d], sharp[d]));
  }
  constexpr double round_off = 1e-12;
  if (grid_->comm().max(most) < round_off) return;
  for (int d = 0; d < 3; ++d) block_.sharp_area[d] = sharp[d];
}

void Transfer::spread(const Components<double>& force) {
  const bool sharp = moment_ > 0;
  const FaceForce spread = sharp ? FaceForce{{raw_[0], raw_[1], raw_[2]}} : faces_;
  resolve_forces(markers_, force);
  with_kernel([&](auto delta) { spread_forces<decltype(delta)>(block_, markers_, spread); });
  for (int d = 0; d < 3; ++d) {
    grid_->halo().exchange(spread.across[d]);
    if (!sharp) continue;
    sharpen_faces(block_.lattice, d, moment_, true, raw_[d], faces_.across[d]);
    grid_->halo().exchange(faces_.across[d]);
  }
}

void Transfer::interpolate(const Array<double> (&flux)[3], const Components<double>& u, const SlipViews* slip,
                           const Components<double>& velocity) {
  const bool sharp = moment_ > 0;
  for (int d = 0; d < 3 && sharp; ++d) {
    copy_faces(block_.index(), d, flux[d], raw_[d]);
    grid_->halo().exchange(raw_[d]);
    sharpen_faces(block_.lattice, d, moment_, false, raw_[d], sharp_flux_[d]);
  }
  with_kernel([&](auto delta) { interpolate_velocity<decltype(delta)>(block_, sharp ? sharp_flux_ : flux, u, markers_); });
  if (slip) add_slip(block_, *slip, markers_);
  collect_velocity(places_.first, markers_, velocity);
}

SlipViews Transfer::slip(const SurfaceSet& surface, const Components<double>& force, double viscosity,
                         const Array<double>& chi) const {
  SlipLaw law{};
  with_kernel([&](auto delta) { law = slip_law<decltype(delta)>(); });
  return {law, viscosity, force, surface.normal, surface.area, chi};
}

int Transfer::at_home() const { return count_at_home(markers_); }

}  // namespace corpuscle
