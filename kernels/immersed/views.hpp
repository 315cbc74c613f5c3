// Arrays that the immersed boundary's kernels share.
#pragma once

#include "immersed/lattice.hpp"
#include "immersed/surface_views.hpp"

namespace corpuscle {

using Key = unsigned long long;
constexpr Key no_key = ~0ull;

/// Shifts under which the surfaces are seen: the identity, and one period up and down each periodic direction. The number of
/// an image has a digit of base 3 for each such direction, the first one's last: 0 none, 1 up, 2 down.
struct Images {
  int count = 1;
  Vec3 shift[27];
};

/// Where the vertices are in index space. Items are vertices times images: item = image * vertices + vertex.
struct PlaceViews {
  Table<double> xi;       // [item, 3] position in index space; valid unless status is failed
  Array<Located> status;  // [item]
  Table<double> pad;      // [item, 3] nodes per direction that the band's width spans
  Array<double> width;    // [item] half-width of the band, um
  Array<int> image;       // [vertex] image under which this rank owns the vertex; -1 if it does not
  Array<int> box;         // [6 * (bodies + 1)] node boxes (lower 3, upper 3, inclusive): all bodies, then each
  Array<Key> found;       // [3] lowest vertex beyond a boundary, packed least distance to a wall, owned vertices
};

/// What the search stores per node; valid where key is not no_key.
struct BandViews {
  Array<Key> key;           // [cell] float bits of the distance, then triangle + triangles * image
  Array<int> cut;           // [cell] bit d: the link from this node along +d crosses a surface
  Array<double> distance;   // [cell] to the closest surface point, um; negative inside
  Components<double> foot;  // [cell, 3] the closest surface point (under its image), um
};

struct NodeViews {
  Array<NodeKind> kind;  // [cell]
  Array<int> body;       // [cell] body that owns an immersed or inside node; -1 elsewhere
};

/// Normals that give the right sign everywhere (Baerentzen & Aanaes 2005): of faces, and angle weighted at vertices.
struct PseudoNormals {
  Components<double> face;    // [triangle, 3] unit
  Components<double> vertex;  // [vertex, 3]
};

KOKKOS_INLINE_FUNCTION Key pack_key(double value, unsigned item) {
  const float rounded = static_cast<float>(value);
  unsigned bits;
  memcpy(&bits, &rounded, sizeof bits);
  return (static_cast<Key>(bits) << 32) | item;
}
KOKKOS_INLINE_FUNCTION double key_value(Key key) {
  const unsigned bits = static_cast<unsigned>(key >> 32);
  float value;
  memcpy(&value, &bits, sizeof value);
  return value;
}
KOKKOS_INLINE_FUNCTION unsigned key_item(Key key) { return static_cast<unsigned>(key & 0xffffffffu); }

/// Body of the closest triangle that a key names.
template <class TriangleBody>
KOKKOS_INLINE_FUNCTION int key_body(const TriangleBody& triangle_body, Key key) {
  return triangle_body(key_item(key) % static_cast<unsigned>(triangle_body.extent(0)));
}

/// Corners of triangle `t` moved by `shift`.
struct Corners {
  Vec3 a, b, c;
};
KOKKOS_INLINE_FUNCTION Corners corners(const SurfaceSet& s, int t, const Vec3& shift) {
  return {load(s.x, s.triangle(t, 0)) + shift, load(s.x, s.triangle(t, 1)) + shift, load(s.x, s.triangle(t, 2)) + shift};
}

/// A box of nodes, lower to upper inclusive, flattened with i fastest.
struct NodeBox {
  int lower[3] = {0, 0, 0}, upper[3] = {-1, -1, -1};

  KOKKOS_INLINE_FUNCTION int extent(int d) const { return upper[d] < lower[d] ? 0 : upper[d] - lower[d] + 1; }
  KOKKOS_INLINE_FUNCTION int size() const { return extent(0) * extent(1) * extent(2); }
  KOKKOS_INLINE_FUNCTION void unpack(int e, int (&i)[3]) const {
    i[0] = lower[0] + e % extent(0);
    i[1] = lower[1] + (e / extent(0)) % extent(1);
    i[2] = lower[2] + e / (extent(0) * extent(1));
  }
  NodeBox grown(int nodes) const {
    NodeBox b = *this;
    for (int d = 0; d < 3; ++d) b.lower[d] -= nodes, b.upper[d] += nodes;
    return b;
  }
  KOKKOS_INLINE_FUNCTION NodeBox clipped(const int (&lo)[3], const int (&hi)[3]) const {
    NodeBox b = *this;
    for (int d = 0; d < 3; ++d) {
      b.lower[d] = b.lower[d] > lo[d] ? b.lower[d] : lo[d];
      b.upper[d] = b.upper[d] < hi[d] ? b.upper[d] : hi[d];
    }
    return b;
  }
};

/// The smallest box that holds both.
inline NodeBox merged(const NodeBox& p, const NodeBox& q) {
  if (p.size() == 0) return q;
  if (q.size() == 0) return p;
  NodeBox b;
  for (int d = 0; d < 3; ++d) {
    b.lower[d] = p.lower[d] < q.lower[d] ? p.lower[d] : q.lower[d];
    b.upper[d] = p.upper[d] > q.upper[d] ? p.upper[d] : q.upper[d];
  }
  return b;
}

}  // namespace corpuscle
