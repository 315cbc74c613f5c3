// Where a place is in a tube or between two walls: along the flow, and across it.
#pragma once

#include "common/types.hpp"
#include "common/vec3.hpp"

namespace corpuscle {

struct FlowPlace {
  double across = 0;               // um: distance to the centreline of a tube, or height over the lower wall
  double along = 0;                // um: arc length from the tube's beginning, or way along the flow
  Vec3 outward;                    // unit vector in which `across` grows; zero on a centreline
  Vec3 tangent, normal, binormal;  // of the flow; across it
  Vec3 offset;                     // tubes: from the centreline
  double bend = 0;                 // tubes: curvature . offset; a piece of the tube is (1 - bend) times as long there as on the centreline
};

/// Columns of the table of a centreline's stations.
struct LineColumn {
  enum : int { position = 0, tangent = 3, normal = 6, binormal = 9, curvature = 12, count = 15 };
};

struct FlowFrame {
  enum class Kind { open, slit, straight, swept };

  Kind kind = Kind::open;          // open: a flow without walls that guide it
  Vec3 origin;                     // slit: on the lower wall; straight tube: where it begins
  Vec3 tangent, normal, binormal;  // slit: of the flow, from the lower wall to the upper; straight tube: its axis, ...
  double width = 0;                // radius of a tube, distance of two walls, um
  Vec3 station_axis;               // unit vector along which stations are counted
  double length = 0;               // of the tube, or of the box along station_axis, um
  bool periodic = false;           // along it
  Vec3 period;                     // of a swept tube
  Table<double> line;              // [station, LineColumn::count] swept tube: evenly spaced from its beginning to its end
  int stations = 0, stride = 1;    // stride: of the coarse search, at most half a radius
  double spacing = 0;

  KOKKOS_INLINE_FUNCTION bool tube() const { return kind == Kind::straight || kind == Kind::swept; }
  KOKKOS_INLINE_FUNCTION bool guided() const { return kind != Kind::open; }
};

KOKKOS_INLINE_FUNCTION Vec3 line_vector(const FlowFrame& f, int station, int column) {
  return {f.line(station, column), f.line(station, column + 1), f.line(station, column + 2)};
}

KOKKOS_INLINE_FUNCTION double square_to_station(const FlowFrame& f, const Vec3& x, int station) {
  const Vec3 apart = x - line_vector(f, station, LineColumn::position);
  return dot(apart, apart);
}

/// The nearest station of a swept tube's centreline: the nearest of a coarse search, and from there downhill.
KOKKOS_INLINE_FUNCTION int nearest_station(const FlowFrame& f, const Vec3& x, double& square) {
  int best = 0;
  square = square_to_station(f, x, 0);
  for (int s = f.stride; s < f.stations + f.stride - 1; s += f.stride) {
    const int station = s < f.stations ? s : f.stations - 1;
    const double at = square_to_station(f, x, station);
    if (at < square) square = at, best = station;
  }
  for (int way = -1; way <= 1; way += 2)
    for (int s = best + way; s >= 0 && s < f.stations; s += way) {
      const double at = square_to_station(f, x, s);
      if (!(at < square)) break;
      square = at, best = s;
    }
  return best;
}

KOKKOS_INLINE_FUNCTION void set_across(const Vec3& offset, FlowPlace& place) {
  place.offset = offset;
  place.across = norm(offset);
  if (place.across > 0) place.outward = (1 / place.across) * offset;
}

/// `along` is continuous through periodic sides: a place beyond the end is farther along than the length.
KOKKOS_INLINE_FUNCTION FlowPlace locate_in_flow(const FlowFrame& f, const Vec3& x) {
  FlowPlace place;
  if (f.kind != FlowFrame::Kind::swept) {
    const Vec3 from = x - f.origin;
    place.along = dot(from, f.tangent);
    place.tangent = f.tangent, place.normal = f.normal, place.binormal = f.binormal;
    if (f.kind == FlowFrame::Kind::straight) {
      set_across(from - place.along * f.tangent, place);
    } else {
      place.across = dot(from, f.normal);
      place.outward = f.normal;
    }
    return place;
  }
  const int most = f.periodic ? 1 : 0;
  double least = 0;
  int station = -1, laps = 0;
  for (int m = -most; m <= most; ++m) {
    double square;
    const int at = nearest_station(f, x - static_cast<double>(m) * f.period, square);
    if (station < 0 || square < least) least = square, station = at, laps = m;
  }
  const Vec3 from = x - static_cast<double>(laps) * f.period - line_vector(f, station, LineColumn::position);
  place.tangent = line_vector(f, station, LineColumn::tangent);
  place.normal = line_vector(f, station, LineColumn::normal);
  place.binormal = line_vector(f, station, LineColumn::binormal);
  const double beyond = dot(from, place.tangent);
  place.along = station * f.spacing + beyond + laps * f.length;
  set_across(from - beyond * place.tangent, place);
  place.bend = dot(line_vector(f, station, LineColumn::curvature), place.offset);
  return place;
}

/// How far along a place is, in windows of which the length has so many; continuous through periodic sides.
KOKKOS_INLINE_FUNCTION double windows_along(const FlowFrame& f, const Vec3& x, const FlowPlace& place, int windows) {
  const double way = f.kind == FlowFrame::Kind::slit ? dot(x - f.origin, f.station_axis) : place.along;
  return way / f.length * windows;
}

/// The window itself, of those there are; -1 beyond the ends.
KOKKOS_INLINE_FUNCTION int window_number(const FlowFrame& f, double along, int windows) {
  const int window = static_cast<int>(std::floor(along));
  if (f.periodic) return ((window % windows) + windows) % windows;
  return window >= 0 && window < windows ? window : -1;
}

/// Outward component of the vector field whose divergence is one nearer to the centreline, or lower, than `edge`, and
/// zero beyond: its flux through a closed surface is the volume that the surface encloses there.
KOKKOS_INLINE_FUNCTION double volume_field(const FlowFrame& f, const FlowPlace& place, double edge) {
  const double c = place.across < edge ? place.across : edge;
  if (!f.tube()) return c;
  if (!(place.across > 0)) return 0;
  return c * c * (0.5 - place.bend / place.across * c / 3) / (place.across * (1 - place.bend));
}

}  // namespace corpuscle
