// How far surfaces go in a step: whether lists still hold, and what goes further than contact can follow.
#pragma once

#include "common/extremes.hpp"
#include "common/joined.hpp"
#include "common/sums.hpp"
#include "contact/contact_lists.hpp"
#include "contact/smooth_motion.hpp"

namespace corpuscle {

/// The longest way, with the lowest vertex that makes it; what is not a number is longer than all.
struct LongestWay : Joined<LongestWay> {
  double way = 0;  // um
  int vertex = 1 << 30;
  int item = -1;  // relative to which, if to any

  template <class Other>
  KOKKOS_INLINE_FUNCTION void join(const Other& b) volatile {
    const bool nothing = way != way, other_nothing = b.way != b.way;
    const bool longer = nothing == other_nothing ? b.way > way || (!(b.way < way) && b.vertex < vertex) : other_nothing;
    if (!longer) return;
    way = b.way;
    vertex = b.vertex;
    item = b.item;
  }
};

/// Means over all vertices.
struct MeanMotion {
  Vec3 way, velocity;              // beyond a smooth motion
  Vec3 whole_way, whole_velocity;  // with it
};

/// @param positions  [vertex, 3] um, from where ways are measured
template <class Positions>
MeanMotion mean_motion(const SurfaceSet& surface, const Positions& positions, const MotionSince& together) {
  const SurfaceSet s = surface;
  const Positions listed = positions;
  const MotionSince all = together;
  Sums<12> mean;
  Kokkos::parallel_reduce(
      "corpuscle::contact::mean_way", Policy(0, s.vertices),
      KOKKOS_LAMBDA(int v, Sums<12>& sum) {
        const Vec3 from{listed(v, 0), listed(v, 1), listed(v, 2)};
        const Vec3 whole_way = load(s.x, v) - from, whole_velocity = load(s.v, v), way = whole_way - all.way(from),
                   velocity = whole_velocity - all.velocity(from);
        for (int d = 0; d < 3; ++d) {
          sum[d] += way[d];
          sum[3 + d] += velocity[d];
          sum[6 + d] += whole_way[d];
          sum[9 + d] += whole_velocity[d];
        }
      },
      mean);
  const double share = 1.0 / s.vertices;
  return {share * Vec3{mean[0], mean[1], mean[2]}, share * Vec3{mean[3], mean[4], mean[5]}, share * Vec3{mean[6], mean[7], mean[8]},
          share * Vec3{mean[9], mean[10], mean[11]}};
}

/// Of all vertices.
struct StepWays : Joined<StepWays> {
  double whole =
      0;  // um, beyond what all do together, from where the lists were made to where the present velocity brings a vertex in a step
  double drift = 0;  // um, the same in space, with what all do together
  LongestWay step;   // what one step may have made of `whole`, or will beyond the mean of all

  template <class Other>
  KOKKOS_INLINE_FUNCTION void join(const Other& b) volatile {
    whole = larger(whole, b.whole);
    drift = larger(drift, b.drift);
    step.join(b.step);
  }
};

/// @param positions  [vertex, 3] um, where the lists were made
/// @param skin       um: vertices had gone half of it at most before the last step
template <class Positions>
StepWays step_ways(const SurfaceSet& surface, const Positions& positions, const MotionSince& together, double skin, double dt) {
  const SurfaceSet s = surface;
  const Positions listed = positions;
  const MotionSince all = together;
  const MeanMotion mean = mean_motion(surface, positions, together);
  StepWays ways;
  Kokkos::parallel_reduce(
      "corpuscle::contact::step_ways", Policy(0, s.vertices),
      KOKKOS_LAMBDA(int v, StepWays& sum) {
        const Vec3 from{listed(v, 0), listed(v, 1), listed(v, 2)}, way = load(s.x, v) - from, velocity = load(s.v, v);
        const double behind = norm(way - all.way(from) - mean.way);
        StepWays own;
        own.whole = behind + dt * norm(velocity - all.velocity(from) - mean.velocity);
        own.drift = norm(way) + dt * norm(velocity);
        const double beyond = behind - 0.5 * skin, since = norm(way - mean.whole_way);  // a flow that turns back brings nothing far
        own.step.way = larger(since < beyond ? since : beyond, dt * norm(velocity - mean.whole_velocity));
        own.step.vertex = v;
        sum += own;
      },
      ways);
  return ways;
}

/// The longest way towards or away from a triangle in its list that a vertex makes in a step, if it is longer than `least` and than
/// their distance: it comes from the other side, or is about to go there. Of the contacts that count.
inline LongestWay longest_passage(const SurfaceSet& surface, const Images& image_shifts, const ContactLists& lists, int own_vertices,
                                  double dt, double least) {
  const SurfaceSet s = surface;
  const Images images = image_shifts;
  const ContactLists in = lists;
  LongestWay longest;
  Kokkos::parallel_reduce(
      "corpuscle::contact::longest_passage", Policy(0, s.vertices),
      KOKKOS_LAMBDA(int v, LongestWay& sum) {
        const Vec3 velocity = load(s.v, v);
        int g = in.first_group(v);
        for (int e = in.first(g), end = in.first(in.first_group(v + 1)); e < end; ++e) {
          while (e == in.first(g + 1)) ++g;
          const int item = in.item(g, e);
          if (!counts(s, v, item, own_vertices)) continue;
          const int t = item_triangle(s, item);
          Vec3 relative[3];
          bool slow = true;
          for (int c = 0; c < 3; ++c) {
            relative[c] = dt * (velocity - load(s.v, s.triangle(t, c)));
            slow = slow && dot(relative[c], relative[c]) <= least * least;
          }
          if (slow) continue;
          const Corners k = corners(s, t, {});
          const Vec3 p = load(s.x, v) + images.shift[item_image(s, item)];
          const TrianglePoint at = closest_on_triangle(p, k.a, k.b, k.c);
          const Vec3 away = p - (at.weight[0] * k.a + at.weight[1] * k.b + at.weight[2] * k.c);
          const Vec3 way = at.weight[0] * relative[0] + at.weight[1] * relative[1] + at.weight[2] * relative[2];
          const double distance = norm(away);
          LongestWay own;
          own.way = distance > 1e-9 ? std::fabs(dot(way, away)) / distance : norm(way);
          if (own.way <= least || own.way <= distance) continue;
          own.vertex = v;
          own.item = item;
          sum += own;
        }
      },
      longest);
  return longest;
}

}  // namespace corpuscle
