// Faces between fluid and immersed nodes, sorted by the body that owns the immersed node.
#pragma once

#include "immersed/views.hpp"

namespace corpuscle {

struct FaceViews {
  Array<int> start;  // [bodies + 1] into the lists below
  Array<int> cell;   // face between cell - stride(direction) and cell
  Array<std::int8_t> direction;
  Array<std::int8_t> sign;  // +1: the fluid node is on the high side, so a flux along +direction enters the fluid
  Array<int> body;
};

/// Faces of owned fluid node (i, j, k) that belong to `body`; calls `found(cell, direction, sign)` for each.
template <class Found>
KOKKOS_INLINE_FUNCTION void node_faces(const IndexSpace& index, const NodeViews& nodes, int c, int body,
                                       const Found& found) {
  if (nodes.kind(c) != NodeKind::fluid) return;
  for (int d = 0; d < 3; ++d) {
    const int stride = index.stride(d);
    if (nodes.kind(c - stride) == NodeKind::immersed && nodes.body(c - stride) == body) found(c, d, 1);
    if (nodes.kind(c + stride) == NodeKind::immersed && nodes.body(c + stride) == body) found(c + stride, d, -1);
  }
}

/// The owned nodes that can have faces of a body.
KOKKOS_INLINE_FUNCTION NodeBox body_box(const IndexSpace& index, const Array<int>& box, int body) {
  NodeBox b;
  for (int d = 0; d < 3; ++d) {
    const int offset = 6 * (1 + body);
    b.lower[d] = box(offset + d) > 0 ? box(offset + d) : 0;
    b.upper[d] = box(offset + 3 + d) < index.n[d] - 1 ? box(offset + 3 + d) : index.n[d] - 1;
  }
  return b;
}

/// Fills faces.start. @returns the number of faces.
inline int count_faces(const IndexSpace& index, const Array<int>& boxes, int bodies, const NodeViews& nodes,
                       const FaceViews& faces) {
  using Team = Kokkos::TeamPolicy<Exec>;
  const auto start = faces.start;
  const NodeViews in = nodes;
  Kokkos::parallel_for(
      "corpuscle::immersed::count_faces", Team(bodies, Kokkos::AUTO), KOKKOS_LAMBDA(const Team::member_type& team) {
        const int body = team.league_rank();
        const NodeBox box = body_box(index, boxes, body);
        int count = 0;
        Kokkos::parallel_reduce(
            Kokkos::TeamThreadRange(team, box.size()),
            [&](int e, int& sum) {
              int i[3];
              box.unpack(e, i);
              node_faces(index, in, index.cell(i[0], i[1], i[2]), body, [&](int, int, int) { ++sum; });
            },
            count);
        Kokkos::single(Kokkos::PerTeam(team), [&]() { start(body) = count; });
      });
  int total = 0;
  Kokkos::parallel_scan(
      "corpuscle::immersed::face_offsets", Policy(0, bodies + 1),
      KOKKOS_LAMBDA(int b, int& sum, bool final) {
        const int count = b < bodies ? start(b) : 0;
        if (final) start(b) = sum;
        sum += count;
      },
      total);
  return total;
}

/// Fills the lists, in ascending order of the fluid node within each body; the lists must be long enough.
inline void list_faces(const IndexSpace& index, const Array<int>& boxes, int bodies, const NodeViews& nodes,
                       const FaceViews& faces) {
  using Team = Kokkos::TeamPolicy<Exec>;
  const FaceViews out = faces;
  const NodeViews in = nodes;
  Kokkos::parallel_for(
      "corpuscle::immersed::list_faces", Team(bodies, Kokkos::AUTO), KOKKOS_LAMBDA(const Team::member_type& team) {
        const int body = team.league_rank(), first = out.start(body);
        const NodeBox box = body_box(index, boxes, body);
        Kokkos::parallel_scan(Kokkos::TeamThreadRange(team, box.size()), [&](int e, int& position, bool final) {
          int i[3];
          box.unpack(e, i);
          node_faces(index, in, index.cell(i[0], i[1], i[2]), body, [&](int cell, int d, int sign) {
            if (final) {
              const int at = first + position;
              out.cell(at) = cell;
              out.direction(at) = static_cast<std::int8_t>(d);
              out.sign(at) = static_cast<std::int8_t>(sign);
              out.body(at) = body;
            }
            ++position;
          });
        });
      });
}

}  // namespace corpuscle
