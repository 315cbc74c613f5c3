// Equal and opposite pushes of contacts, on a vertex and on the corners of its triangle, summed in a fixed order.
#pragma once

#include "common/counting_sort.hpp"
#include "contact/contact_law.hpp"
#include "contact/contact_views.hpp"

namespace corpuscle {

/// Fills hit_start and hit: contacts that push, by triangle and in each in the order of their numbers.
inline void sort_hits(const SurfaceSet& surface, int groups, const ContactViews& contacts, const ContactPushes& pushes) {
  const SurfaceSet s = surface;
  const auto item = contacts.item;
  const auto push = pushes.push;
  counting_sort(
      "corpuscle::contact::sort_hits", groups, s.triangles,
      KOKKOS_LAMBDA(int g) { return push(g) != 0 ? item_triangle(s, item(g)) : -1; }, pushes.hit_start, pushes.hit);
}

/// Adds the pushes to `sum` [vertex, 3] of the first `vertices`. After sort_hits().
inline void add_pushes(const SurfaceSet& surface, const ContactLists& lists, const ContactViews& contacts,
                       const ContactPushes& pushes, int vertices, const Components<double>& sum) {
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
inline void contact_forces(const SurfaceSet& surface, const ContactLaw& contact_law, const ContactRest& at_rest,
                           const ContactLists& lists, const ContactViews& contacts, const Array<double>& push) {
  const SurfaceSet s = surface;
  const ContactLaw law = contact_law;
  const auto area = at_rest.area, force = push;
  const auto first = lists.first_group;
  const ContactViews c = contacts;
  Kokkos::parallel_for(
      "corpuscle::contact::forces", Policy(0, s.vertices), KOKKOS_LAMBDA(int v) {
        for (int g = first(v); g < first(v + 1); ++g)
          force(g) = c.item(g) < 0 ? 0 : 0.5 * area(v) * law.total_pressure(c.gap(g), !same_body(s, v, c.item(g)));
      });
}

/// Energy of the contacts of the first `vertices`, fJ.
inline double contact_energy(const SurfaceSet& surface, const ContactLaw& contact_law, const ContactRest& at_rest,
                             const ContactLists& lists, const ContactViews& contacts, int vertices) {
  const SurfaceSet s = surface;
  const ContactLaw law = contact_law;
  const auto area = at_rest.area;
  const auto first = lists.first_group;
  const ContactViews c = contacts;
  double energy = 0;
  Kokkos::parallel_reduce(
      "corpuscle::contact::energy", Policy(0, vertices),
      KOKKOS_LAMBDA(int v, double& sum) {
        for (int g = first(v); g < first(v + 1); ++g)
          if (c.item(g) >= 0) sum += 0.5 * area(v) * law.total_energy(c.gap(g), !same_body(s, v, c.item(g)));
      },
      energy);
  return energy;
}

}  // namespace corpuscle
