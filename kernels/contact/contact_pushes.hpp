// Equal and opposite pushes of contacts, on a vertex and on the corners of its triangle, summed in a fixed order.
#pragma once

#include "common/counting_sort.hpp"
#include "common/sums.hpp"
#include "contact/contact_law.hpp"
#include "contact/contact_views.hpp"

namespace corpuscle {

/// Fills hit_start and hit: contacts that push, by triangle and in each in the order of their numbers.
inline void sort_hits(const SurfaceSet& surface, int groups, const ContactViews& contacts, const ContactPushes& pushes) {
  const SurfaceSet s = surface;
  const auto item = contacts.item;
  const auto push = pushes.push;
  counting_sort(
      "corpuscle::contact::sort_hits", groups, s.triangles, KOKKOS_LAMBDA(int g) { return push(g) != 0 ? item_triangle(s, item(g)) : -1; },
      pushes.hit_start, pushes.hit);
}

/// Adds the pushes to `sum` [vertex, 3] of the first `vertices`. After sort_hits().
inline void add_pushes(const SurfaceSet& surface, const ContactLists& lists, const ContactViews& contacts, const ContactPushes& pushes,
                       int vertices, const Components<double>& sum) {
  const SurfaceSet s = surface;
  const auto first = lists.first_group;
  const ContactViews c = contacts;
  const ContactPushes by = pushes;
  Kokkos::parallel_for(
      "corpuscle::contact::add_pushes", Policy(0, vertices), KOKKOS_LAMBDA(int v) {
        Vec3 total = load(sum, v);
        for (int g = first(v); g < first(v + 1); ++g)
          if (c.item(g) >= 0) total += by.push(g) * load(c.normal, g);
        for (int r = s.ring_start(v); r < s.ring_start(v + 1); ++r) {
          const int t = s.ring_triangle(r), corner = s.ring_corner(r);
          for (int h = by.hit_start(t); h < by.hit_start(t + 1); ++h) {
            const int g = by.hit(h);
            total -= (by.push(g) * c.weight(g, corner)) * load(c.normal, g);
          }
        }
        store(sum, v, total);
      });
}

/// push: the force between a vertex and a triangle, nN. Each of two bodies sees the other, so each counts half.
inline void contact_forces(const SurfaceSet& surface, const ContactLaw& contact_law, const ContactRest& at_rest, const ContactLists& lists,
                           const ContactViews& contacts, const Array<double>& push) {
  const SurfaceSet s = surface;
  const ContactLaw law = contact_law;
  const ContactRest rest = at_rest;
  const auto force = push;
  const auto first = lists.first_group;
  const ContactViews c = contacts;
  Kokkos::parallel_for(
      "corpuscle::contact::forces", Policy(0, s.vertices), KOKKOS_LAMBDA(int v) {
        for (int g = first(v); g < first(v + 1); ++g)
          force(g) = c.item(g) < 0 ? 0 : 0.5 * rest.area_of(s, v) * law.total_pressure(c.gap(g), !same_body(s, v, c.item(g)));
      });
}

/// Energy of the contacts that count, fJ.
inline double contact_energy(const SurfaceSet& surface, const ContactLaw& contact_law, const ContactRest& at_rest,
                             const ContactLists& lists, const ContactViews& contacts, int own) {
  const SurfaceSet s = surface;
  const ContactLaw law = contact_law;
  const ContactRest rest = at_rest;
  const auto first = lists.first_group;
  const ContactViews c = contacts;
  double energy = 0;
  Kokkos::parallel_reduce(
      "corpuscle::contact::energy", Policy(0, s.vertices),
      KOKKOS_LAMBDA(int v, double& sum) {
        for (int g = first(v); g < first(v + 1); ++g)
          if (c.item(g) >= 0 && counts(s, v, c.item(g), own))
            sum += 0.5 * rest.area_of(s, v) * law.total_energy(c.gap(g), !same_body(s, v, c.item(g)));
      },
      energy);
  return energy;
}

struct RigidNumber {
  SurfaceSet surface;
  int number;
  KOKKOS_INLINE_FUNCTION bool operator()(int body) const { return body >= surface.cells && surface.number(body) == number; }
};

/// Force of the contacts that count on a rigid body and all its images, nN, and its power, nW.
inline Sums<4> contact_load_on_rigid(const SurfaceSet& surface, const ContactLaw& contact_law, const ContactRest& at_rest,
                                     const ContactLists& lists, const ContactViews& contacts, int own, int rigid_body) {
  const SurfaceSet s = surface;
  const ContactLaw law = contact_law;
  const ContactRest rest = at_rest;
  const auto first = lists.first_group;
  const ContactViews c = contacts;
  const RigidNumber is{s, rigid_body};
  Sums<4> load_on_body;
  Kokkos::parallel_reduce(
      "corpuscle::contact::load_on_rigid", Policy(0, s.vertices),
      KOKKOS_LAMBDA(int v, Sums<4>& sum) {
        for (int g = first(v); g < first(v + 1); ++g) {
          if (c.item(g) < 0 || !counts(s, v, c.item(g), own)) continue;
          const int t = item_triangle(s, c.item(g));
          const bool vertex = is(s.vertex_body(v));
          if (!vertex && !is(s.triangle_body(t))) continue;
          const double push = (vertex ? 0.5 : -0.5) * rest.area_of(s, v) * law.total_pressure(c.gap(g), true);
          Vec3 velocity = load(s.v, v);
          if (!vertex) {
            velocity = {};
            for (int k = 0; k < 3; ++k) velocity += c.weight(g, k) * load(s.v, s.triangle(t, k));
          }
          const Vec3 force = push * load(c.normal, g);
          for (int d = 0; d < 3; ++d) sum[d] += force[d];
          sum[3] += dot(force, velocity);
        }
      },
      load_on_body);
  return load_on_body;
}

}  // namespace corpuscle
