#include "transfer/transfer.hpp"

#include <algorithm>
#include <cmath>

#include "transfer/delta.hpp"
#include "transfer/kink.hpp"
#include "transfer/marker_bins.hpp"
#include "transfer/pressure_jump.hpp"
#include "transfer/sharpen.hpp"
#include "transfer/transfer_kernels.hpp"
#include "transfer/vertex_forces.hpp"

namespace corpuscle {

namespace {

template <class View, class... Extents>
View make(const char* name, Extents... extents) {
  return View(uninitialised(std::string("corpuscle::transfer::") + name), extents...);
}

/// Out of the grid at a node on its side across d, unit.
template <class Positions>
Vec3 outward_of(const Lattice& lattice, const Positions& x, const int (&at)[3], int d) {
  const int inward = at[d] == lattice.lower[d] ? 1 : -1, c = lattice.node(at[0], at[1], at[2]);
  const Vec3 way = load(x, c) - load(x, c + inward * lattice.index.stride(d));
  return (1 / norm(way)) * way;
}

/// Bounds of the lattice in space, beyond the grid's sides widened by one of its links, and its nodes in bins. Beyond other blocks and
/// periodic sides no marker reaches this one.
/// @returns the longest link
double find_bounds(const Lattice& lattice, MarkerSearch& search) {
  constexpr double round_off = 1e-6;  // of a link
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), lattice.x);
  double link = 0, sum = 0;
  long links = 0;
  const auto for_nodes = [&](const auto& use) {
    for (int k = lattice.lower[2]; k <= lattice.upper[2]; ++k)
      for (int j = lattice.lower[1]; j <= lattice.upper[1]; ++j)
        for (int i = lattice.lower[0]; i <= lattice.upper[0]; ++i) {
          const int at[3] = {i, j, k};
          use(at, load(x, lattice.node(i, j, k)));
        }
  };
  const auto take_in = [&](const Vec3& p) {
    for (int d = 0; d < 3; ++d) {
      search.lower[d] = std::min(search.lower[d], p[d]);
      search.upper[d] = std::max(search.upper[d], p[d]);
    }
  };
  search.lower = {1e300, 1e300, 1e300};
  search.upper = {-1e300, -1e300, -1e300};
  for_nodes([&](const int(&at)[3], const Vec3& p) {
    take_in(p);
    for (int d = 0; d < 3; ++d) {
      if (at[d] == lattice.upper[d]) continue;
      const double length = norm(load(x, lattice.node(at[0], at[1], at[2]) + lattice.index.stride(d)) - p);
      link = std::max(link, length);
      sum += length, ++links;
    }
  });
  search.bins = make_node_bins(lattice, search.lower, search.upper, sum / static_cast<double>(links), link);
  for_nodes([&](const int(&at)[3], const Vec3& p) {
    for (int d = 0; d < 3; ++d)
      if ((lattice.boundary_below[d] && at[d] == lattice.lower[d]) || (lattice.boundary_above[d] && at[d] == lattice.upper[d]))
        take_in(p + link * outward_of(lattice, x, at, d));
  });
  const double margin = round_off * link;
  search.lower -= {margin, margin, margin};
  search.upper += {margin, margin, margin};
  return link;
}

using Fluxes = Array<double>[3];
const Fluxes& const_fluxes(const Fluxes& fluxes) { return fluxes; }

/// Whether all faces of each direction have the same area, to round-off (all ranks call).
bool are_even(const Grid& grid, const Components<double> (&area)[3]) {
  constexpr double round_off = 1e-12;
  const IndexSpace& index = grid.index();
  bool even = true;
  for (int d = 0; d < 3; ++d) {
    const auto host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), area[d]);
    const CellBox box = face_box(index, d);
    double lowest[3] = {1e300, 1e300, 1e300}, highest[3] = {-1e300, -1e300, -1e300}, size = 0;
    for (int k = box.lower[2]; k < box.upper[2]; ++k)
      for (int j = box.lower[1]; j < box.upper[1]; ++j)
        for (int i = box.lower[0]; i < box.upper[0]; ++i) {
          const Vec3 here = load(host, index.cell(i, j, k));
          size = std::max(size, norm(here));
          for (int m = 0; m < 3; ++m) lowest[m] = std::min(lowest[m], here[m]), highest[m] = std::max(highest[m], here[m]);
        }
    for (int m = 0; m < 3; ++m)
      if (grid.comm().max(highest[m]) - grid.comm().min(lowest[m]) > round_off * grid.comm().max(size)) even = false;
  }
  return even;
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

Transfer::Transfer(Grid& grid, const std::vector<BoundarySettings>& boundaries, CouplingSettings::Kernel kernel, int vertices,
                   std::shared_ptr<Workspace> workspace)
    : grid_(&grid), kernel_(kernel), workspace_(std::move(workspace)) {
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
  block_.even = are_even(grid, block_.area);
  set_reflections(boundaries, block_);
  search_.lattice = block_.lattice;
  largest_spacing_ = find_bounds(block_.lattice, search_);
  with_kernel([&](auto delta) { search_.reach = decltype(delta)::reach; });
  places_.beyond = make<Array<int>>("beyond", 1);
  beyond_host_ = HostCopy(places_.beyond);
  markers_.start = make<Array<int>>("cell_start", cells + 1);
  markers_.near = make<Array<unsigned char>>("cell_near", cells);
  first_of_plane_ = make<Array<int>>("first_of_plane", block_.index().padded(2) + 1);
  first_of_plane_host_ = HostCopy(first_of_plane_);
  make_places(vertices);
}

/// Of vertices of which nothing is known.
void Transfer::make_places(int vertices) {
  places_.vertices = vertices;
  if (!places_.known.data() || places_.known.extent(0) < static_cast<std::size_t>(vertices)) {
    const int room = vertices + vertices / 64 + 1;
    places_.xi = Table<double>();
    places_.xi = make<Table<double>>("vertex_xi", room, 3);
    places_.known = make<Array<unsigned char>>("vertex_known", room);
    places_.reach = make<Array<unsigned char>>("vertex_reach", room);
  }
  Kokkos::deep_copy(places_.known, static_cast<unsigned char>(0));
}

void Transfer::take_up(const SurfaceSet& set) { make_places(set.vertices); }

void Transfer::make_room(int markers) {
  if (markers > room_) {
    room_ = markers + markers / 64 + 1;
    markers_.vertex = make<Array<int>>("marker_vertex", room_);
    markers_.home = make<Array<unsigned char>>("marker_home", room_);
    markers_.order = make<Array<int>>("marker_order", room_);
  }
}

/// A quarter of all, but so many that the markers which reach several of the parts are not too many, and no thread goes without.
int Transfer::planes_at_once() const {
  constexpr int parts = 4, fewest = 6;
  const int planes = block_.rows(2, true), cells = block_.rows(0, true) * block_.rows(1, true);
  return std::max({fewest, (planes + parts - 1) / parts, Exec().concurrency() / cells});
}

/// use(planes) for all of the block's cells and faces, some planes at a time, of which the markers that reach them have rows then.
template <class Delta, class Use>
void Transfer::for_planes(const Use& use) {
  constexpr int points = Delta::points, halo = IndexSpace::halo;
  const int planes = block_.rows(2, true), at_once = planes_at_once();
  if (!marked_) {
    mark_near<Delta>(block_, markers_);
    first_of_planes(block_.index(), markers_, first_of_plane_);
  }
  const auto& first = first_of_plane_host_.read();
  marked_ = true;
  const auto below = [&](int plane) { return first(plane + MarkerReach<Delta>::below + halo); };
  const auto above = [&](int plane) { return first(plane + MarkerReach<Delta>::above + halo); };
  std::size_t most = 1;
  for (int begin = 0; begin < planes; begin += at_once)
    most = std::max<std::size_t>(most, above(std::min(begin + at_once, planes)) - below(begin));
  const std::size_t dipoles = ratios_.empty() ? 0 : 3;
  double* const memory =
      workspace_->reserve((6 * points + 3 + dipoles) * most + (6 * most * sizeof(short) + sizeof(double) - 1) / sizeof(double));
  markers_.weight = Table<double>(memory, most, 6 * points);
  markers_.across = Table<double>(memory + 6 * points * most, most, 3);
  markers_.dipole = Table<double>(memory + (6 * points + 3) * most, dipoles > 0 ? most : 0, dipoles);
  markers_.base = Table<short>(reinterpret_cast<short*>(memory + (6 * points + 3 + dipoles) * most), most, 6);
  for (int begin = 0; begin < planes; begin += at_once) {
    const int end = std::min(begin + at_once, planes);
    markers_.first = below(begin);
    markers_.rows = above(end) - below(begin);
    prepare_markers<Delta>(block_, markers_);
    use(Planes{begin, end});
  }
}

int Transfer::place(const Components<double>& x) {
  find_vertices(search_, x, places_);
  markers_.count = number_markers(places_, markers_, room_);
  const bool again = markers_.count > room_;
  make_room(markers_.count);
  if (again) number_markers(places_, markers_, room_);
  markers_.xi = places_.xi;
  fill_markers(search_, markers_);
  sort_markers(block_.lattice, markers_);
  marked_ = false;
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
    Kokkos::deep_copy(sharp[d], block_.area[d]);  // as those of sides stay, which other ranks' blocks see too
    for (int m = 0; m < 3; ++m)
      sharpen_faces(block_, Sharpen::areas, d, moment_, {}, Kokkos::subview(block_.area[d], Kokkos::ALL, m),
                    Kokkos::subview(sharp[d], Kokkos::ALL, m));
    grid_->halo().exchange(sharp[d]);
    most = std::max(most, largest_difference(index, d, block_.area[d], sharp[d]));
  }
  constexpr double round_off = 1e-12;
  if (grid_->comm().max(most) < round_off) return;
  for (int d = 0; d < 3; ++d) block_.sharp_area[d] = sharp[d];
}

void Transfer::spread(const Components<double>& force, const SlipViews* slip) { spread_rest(force, nullptr, slip); }

void Transfer::spread(const Components<double>& force, const SurfaceSet& surface, const SlipViews* slip) {
  const std::size_t vertices = surface.vertices;
  if (jump_->rest.extent(0) < vertices) {
    const std::size_t room = vertices + vertices / 16 + 1;
    jump_->jump = make<Array<double>>("jump", 2 * room);
    jump_->rest = make<Components<double>>("jump_rest", room, 3);
  }
  const Array<double> once = Kokkos::subview(jump_->jump, std::make_pair(jump_->rest.extent(0), jump_->jump.extent(0)));
  normal_loads(surface, force, jump_->jump);
  smooth_loads(surface, jump_->jump, once);
  smooth_loads(surface, once, jump_->jump);
  rest_of_loads(surface, force, jump_->jump, jump_->rest);
  spread_rest(jump_->rest, &surface, slip);
}

/// @param surface  null where there is no more to them
void Transfer::spread_rest(const Components<double>& force, const SurfaceSet* surface, const SlipViews* slip) {
  const bool sharp = moment_ > 0;
  const FaceForce spread = sharp ? FaceForce{{raw_[0], raw_[1], raw_[2]}} : faces_;
  with_kernel([&](auto delta) {
    using Delta = decltype(delta);
    for_planes<Delta>([&](const Planes& planes) {
      if (slip && !ratios_.empty()) {
        resolve_kinked_forces<Delta>(block_, *slip, markers_, force);
        for (int d = 0; d < 3; ++d) {  // one by one, for the memory
          resolve_dipoles<Delta>(block_, *slip, markers_, force, d);
          spread_dipoles<Delta>(block_, markers_, planes, d, spread.across[d]);
        }
      } else {
        resolve_forces<Delta>(block_, markers_, force);
        spread_forces<Delta>(block_, markers_, planes, spread);
      }
    });
  });
  for (int d = 0; d < 3 && sharp; ++d) {
    grid_->halo().exchange(raw_[d]);
    sharpen_faces(block_, Sharpen::forces, d, moment_, {}, raw_[d], faces_.across[d]);
  }
  if (surface) add_pressure_jumps(*surface);
  for (int d = 0; d < 3; ++d) grid_->halo().exchange(faces_.across[d]);
}

void Transfer::find_corners() {
  if (corners_) return;
  corners_ = true;
  const Vec3 link{largest_spacing_, largest_spacing_, largest_spacing_};
  search_.lower -= link;
  search_.upper += link;
}

void Transfer::sharpen_pressure() {
  find_corners();
  jump_.emplace();
  jump_->sum = Array<std::int64_t>("corpuscle::transfer::jump_sum", block_.index().size());
}

bool Transfer::reach_too_far(const SurfaceSet& surface) const { return jumps_beyond_knowledge(search_, places_, surface); }

void Transfer::add_pressure_jumps(const SurfaceSet& surface) {
  constexpr double least = 1e-200;  // kPa
  constexpr int bits = 51;          // of a jump: a thousand of them on one face are still an integer of 62
  const double most = largest_jump(surface.vertices, jump_->jump);
  if (!std::isfinite(most) || most < least) return;  // what is not a number is so in what is spread, too
  const double scale = std::ldexp(1.0, bits - std::ilogb(most) - 1);
  for (int d = 0; d < 3; ++d) {
    sum_jumps(search_, places_, surface, d, jump_->jump, scale, jump_->sum);
    add_jumps(block_.index(), d, jump_->sum, scale, faces_.across[d]);
  }
}

void Transfer::interpolate(const Array<double> (&flux)[3], const Components<double>& u, const SlipViews* slip,
                           const Components<double>& velocity) {
  Kokkos::deep_copy(Exec(), velocity, 0.0);
  const bool sharp = moment_ > 0;
  for (int d = 0; d < 3 && sharp; ++d) {
    copy_faces(block_.index(), d, flux[d], raw_[d]);
    grid_->halo().exchange(raw_[d]);
    sharpen_faces(block_, Sharpen::fluxes, d, moment_, u, raw_[d], sharp_flux_[d]);
  }
  const auto& through = sharp ? const_fluxes(sharp_flux_) : flux;
  with_kernel([&](auto delta) {
    interpolate_velocity<decltype(delta)>(block_, through, u, markers_, velocity);
    if (slip && !ratios_.empty()) add_kinks<decltype(delta)>(block_, *slip, through, u, markers_, velocity);
  });
  if (slip) add_slip(block_, *slip, markers_, velocity);
}

/// What vertices have of the sides' velocities is what they have where all fluxes are zero.
double Transfer::power_on_sides(const Components<double>& force, const Components<double>& u, const SlipViews* slip) {
  const std::size_t vertices = places_.vertices;
  const Components<double> of_sides(workspace_->reserve(3 * vertices), vertices, 3);
  const bool sharp = moment_ > 0;
  for (int d = 0; d < 3; ++d) {
    if (!raw_[d].data()) raw_[d] = Array<double>("corpuscle::transfer::raw_face", block_.index().size());
    Kokkos::deep_copy(raw_[d], 0.0);
    if (sharp) sharpen_faces(block_, Sharpen::fluxes, d, moment_, u, raw_[d], sharp_flux_[d]);
  }
  Kokkos::deep_copy(of_sides, 0.0);
  const auto& through = const_fluxes(sharp ? sharp_flux_ : raw_);
  with_kernel([&](auto delta) {
    interpolate_velocity<decltype(delta)>(block_, through, u, markers_, of_sides);
    if (slip && !ratios_.empty()) add_kinks<decltype(delta)>(block_, *slip, through, u, markers_, of_sides);
  });
  return power_of(places_.vertices, force, of_sides);
}

void Transfer::slip_between(const std::vector<double>& ratios) {
  ratios_ = ratios;
  ratio_ = make<Array<double>>("slip_ratio", ratios.size());
  const auto host = Kokkos::create_mirror_view(ratio_);
  std::copy(ratios.begin(), ratios.end(), host.data());
  Kokkos::deep_copy(ratio_, host);
}

SlipLaw Transfer::law_of_slip() const {
  SlipLaw law{};
  with_kernel([&](auto delta) { law = slip_law<decltype(delta)>(); });
  return law;
}

SlipViews Transfer::slip(const SurfaceSet& surface, const Components<double>& force, double viscosity, const Array<int>& type,
                         const Array<double>& gap, const Components<double>& followed) const {
  const Array<double> ratio = type.extent(0) > 0 ? ratio_ : Array<double>();
  return {law_of_slip(), viscosity, force, surface.normal, surface.area, gap, followed, surface.vertex_body, type, ratio};
}

double Transfer::largest_dipole() const {
  double most = 0;
  for (double ratio : ratios_) {
    const double kink = kink_between(law_of_slip(), ratio);
    most = std::max(most, 0.5 * (1 + 1 / ratio) * kink * kink);
  }
  return most;
}

double Transfer::marker_radius() const {
  double radius = 0;
  with_kernel([&](auto delta) { radius = decltype(delta)::radius; });
  return radius;
}

int Transfer::at_home() const { return count_at_home(markers_); }

void Transfer::mark_at_home(const Components<double>& count) const { corpuscle::mark_at_home(markers_, count); }

}  // namespace corpuscle
