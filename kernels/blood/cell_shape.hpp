// What shape cells have, and how their membranes have turned.
#pragma once

#include "blood/flow_frame.hpp"
#include "common/sums.hpp"
#include "common/symmetric.hpp"
#include "immersed/surface_views.hpp"
#include "membrane/sections.hpp"

namespace corpuscle {

/// Columns of the table that measure_shapes fills, one row a cell. Angles in degrees, in the plane of the flow and the
/// direction across it, from the flow towards across; where they begin again is aslant, so that no cell that lies along
/// or across the flow is there.
struct ShapeColumn {
  enum : int {
    deformation = 0,     // Taylor's: (L - B) / (L + B) of the ellipsoid of equal inertia, its longest and shortest axes
    inclination = 1,     // of the long axis that it has in the plane, -45 to 135; not a number where that is round
    membrane_angle = 2,  // to which the membrane has carried the cell's own axis, -135 to 225
    phase = 3,           // from the long axis to there, -45 to 135: constant as the cell tumbles; goes round twice as the
                         // membrane does once
    count = 4
  };
};

/// The same angle, of those that a turn of `period` leaves as they are, between -45 or -135 and that and the period.
KOKKOS_INLINE_FUNCTION double begin_aslant(double degrees, double period) {
  const double first = period < 360 ? -45 : -135;
  return degrees - period * std::floor((degrees - first) / period);
}

/// Where a type's vertices are on its mesh, mapped so that they are spread evenly in all directions: then a cell's
/// vertices are a rotation, a stretch and a rotation of them, whatever the shape at rest.
struct MaterialViews {
  Components<double> place;  // [vertex of all types, 3]
  Array<int> first;          // [type]
};

/// Of the volume: itself, its first and its second moments, about the origin, from the tetrahedron below one triangle.
KOKKOS_INLINE_FUNCTION Sums<10> tetrahedron_moments(const Vec3 (&a)[3]) {
  const double volume = dot(a[0], cross(a[1], a[2])) / 6;
  const Vec3 sum = a[0] + a[1] + a[2];
  Sums<10> m;
  m[0] = volume;
  for (int d = 0; d < 3; ++d) m[1 + d] = volume / 4 * sum[d];
  int n = 4;
  for (int d = 0; d < 3; ++d)
    for (int e = d; e < 3; ++e) {
      double products = sum[d] * sum[e];
      for (const Vec3& corner : a) products += corner[d] * corner[e];
      m[n++] = volume / 20 * products;
    }
  return m;
}

/// Second moments of the volume about its centroid, from sums of the above.
KOKKOS_INLINE_FUNCTION void central_moments(const Sums<10>& m, double (&second)[3][3]) {
  int n = 4;
  for (int d = 0; d < 3; ++d)
    for (int e = d; e < 3; ++e, ++n) second[d][e] = second[e][d] = m[n] - m[1 + d] * m[1 + e] / m[0];
}

KOKKOS_INLINE_FUNCTION double quadratic(const double (&m)[3][3], const Vec3& a, const Vec3& b) {
  double sum = 0;
  for (int d = 0; d < 3; ++d)
    for (int e = 0; e < 3; ++e) sum += a[d] * m[d][e] * b[e];
  return sum;
}

/// Angle of the long axis in the plane of two unit vectors, degrees; not a number where none is longer by a millionth.
KOKKOS_INLINE_FUNCTION double inclination_deg(const double (&second)[3][3], const Vec3& flow, const Vec3& across) {
  constexpr double to_degrees = 180 / 3.14159265358979323846;
  const double twice_mixed = 2 * quadratic(second, flow, across);
  const double along = quadratic(second, flow, flow), beside = quadratic(second, across, across);
  if (std::abs(twice_mixed) + std::abs(along - beside) < 1e-6 * (along + beside)) return std::nan("");
  return begin_aslant(0.5 * to_degrees * std::atan2(twice_mixed, along - beside), 180);
}

/// Angle in that plane to which the rotation has carried the cell: that of the sum of its own z axis' part there and, turned back by a
/// right angle, half of its x axis'. So it is the z axis' wherever that is in the plane; a turn in the plane adds what it turns by; and
/// it goes on without a jump where the z axis leaves the plane. No angle can do so everywhere: this one has no meaning where the z axis
/// is 30 degrees from the plane's normal and the x axis at a right angle to both, on one side.
KOKKOS_INLINE_FUNCTION double axis_angle_deg(const Vec3 (&rotation)[3], const Vec3& flow, const Vec3& across) {
  constexpr double to_degrees = 180 / 3.14159265358979323846, share = 0.5;
  const Vec3 &x = rotation[0], &z = rotation[2];
  return begin_aslant(to_degrees * std::atan2(dot(z, across) - share * dot(x, flow), dot(z, flow) + share * dot(x, across)), 360);
}

/// The rows of the first `cells` cells. @param table  [cells, ShapeColumn::count]; angles only where the flow is guided
inline void measure_shapes(const SurfaceSet& set, int cells, const Array<int>& type, const MaterialViews& material, const FlowFrame& frame,
                           const Table<double>& table) {
  using Column = ShapeColumn;
  const auto x = set.x, reference = material.place;
  const SurfaceSet s = set;
  const auto first_vertex = set.first_vertex, first_triangle = set.first_triangle, first_of_type = material.first;
  Kokkos::parallel_for(
      "corpuscle::blood::measure_shapes", Kokkos::TeamPolicy<Exec>(cells, Kokkos::AUTO), KOKKOS_LAMBDA(const SectionTeam& team) {
        const int cell = team.league_rank(), first = first_vertex(cell), shift = first_of_type(type(cell)) - first;
        const Vec3 origin = load(x, first);
        Sums<10> moments;
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, first_triangle(cell), first_triangle(cell + 1)),
            [&](int t, Sums<10>& sum) {
              Vec3 corner[3];
              for (int k = 0; k < 3; ++k) corner[k] = load(x, s.triangle(t, k)) - origin;
              sum += tetrahedron_moments(corner);
            },
            moments);
        Sums<9> carried;
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, first, first_vertex(cell + 1)),
            [&](int i, Sums<9>& sum) {
              for (int d = 0; d < 3; ++d)
                for (int e = 0; e < 3; ++e) sum[3 * e + d] += (x(i, d) - origin[d]) * reference(i + shift, e);
            },
            carried);
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          double second[3][3], diagonal[3][3];
          central_moments(moments, second);
          central_moments(moments, diagonal);
          const SymmetricEigen axes = eigen_of(diagonal);
          const double longest = std::sqrt(axes.value[2]), shortest = std::sqrt(axes.value[0]);
          table(cell, Column::deformation) = (longest - shortest) / (longest + shortest);
          if (!frame.guided()) return;
          const Vec3 centroid = origin + (1 / moments[0]) * Vec3{moments[1], moments[2], moments[3]};
          const FlowPlace place = locate_in_flow(frame, centroid);
          const bool on_axis = place.across < 1e-3 * frame.width;  // where no direction across is the cell's own
          const Vec3 across = on_axis || !frame.tube() ? place.normal : place.outward;
          const double inclination = inclination_deg(second, place.tangent, across);
          Vec3 rotation[3];
          for (int e = 0; e < 3; ++e) rotation[e] = {carried[3 * e], carried[3 * e + 1], carried[3 * e + 2]};
          const double angle = to_rotation(rotation) ? axis_angle_deg(rotation, place.tangent, across) : std::nan("");
          table(cell, Column::inclination) = inclination;
          table(cell, Column::membrane_angle) = angle;
          table(cell, Column::phase) = begin_aslant(angle - inclination, 180);
        });
      });
}

}  // namespace corpuscle
