// The closed triangulated surfaces immersed in the fluid, all bodies in one set of arrays. Membranes and rigid bodies
// both appear to the fluid as this.
#pragma once

#include "common/types.hpp"

namespace corpuscle {

constexpr int no_vertex = 1 << 30;

struct CellNames;  // of the host alone

/// Vertices and triangles are numbered over all bodies; triangles are counter-clockwise seen from outside. Every rank holds all
/// surfaces, or those that reach into its block (SharedCells): then copies of other ranks' cells, and of its own where a
/// periodic side brings them back, follow its own cells, shifted to where this block sees them. Arrays may have room for more
/// than there is. How vertices and triangles hang together is held once for bodies that are alike, in tables: `place` is that in a table.
struct SurfaceSet {
  int bodies = 0, vertices = 0, triangles = 0;
  int cells = 0;                         // the first bodies are membranes, the others rigid
  int own_cells = 0;                     // the first membranes are this rank's own, the others copies
  int own_vertices = 0;                  // of them
  Array<int> number;                     // [body] of the cell in the whole scene, the same for its copies; of a rigid body among those
  Components<double> x;                  // [vertex, 3] um
  Components<double> v;                  // [vertex, 3] um/us
  Components<double> normal;             // [vertex, 3] outward unit normal, area weighted
  Array<double> area;                    // [vertex] a third of the areas of its triangles, um2
  Array<int> vertex_body;                // [vertices + 1] body number; behind the last vertex the number of bodies
  Array<int> triangle_body;              // [triangle]
  Array<int> first_vertex;               // [bodies + 1]
  Array<int> first_triangle;             // [bodies + 1]
  Table<int> to_place;                   // [bodies + 1, 2] from numbers to places, of vertices and of triangles
  Table<int> place_triangle;             // [triangle place, 3] vertex places
  Table<int> place_neighbour;            // [triangle place, 3] triangle places
  Array<int> place_ring_start;           // [vertex place] into the two below
  Array<int> place_ring_triangle;        // [ring place] triangle places
  Array<std::int8_t> place_ring_corner;  // [ring place]
  const CellNames* names = nullptr;      // for messages; null: all cells are those that a case lists

  KOKKOS_INLINE_FUNCTION int vertex_place(int vertex) const { return vertex + to_place(vertex_body(vertex), 0); }
  /// Number of the vertex at corner k of triangle t.
  KOKKOS_INLINE_FUNCTION int triangle(int t, int k) const {
    const int body = triangle_body(t);
    return place_triangle(t + to_place(body, 1), k) - to_place(body, 0);
  }
  /// Number of the triangle across the edge opposite corner k.
  KOKKOS_INLINE_FUNCTION int neighbour(int t, int k) const {
    const int shift = to_place(triangle_body(t), 1);
    return place_neighbour(t + shift, k) - shift;
  }
  /// The first of the ring entries of a vertex, of which there are as many as triangles around it; of the one behind the last vertex
  /// the number of all.
  KOKKOS_INLINE_FUNCTION int ring_start(int vertex) const {
    const int body = vertex_body(vertex);
    return place_ring_start(vertex + to_place(body, 0)) - 3 * to_place(body, 1);
  }
  /// Number of the triangle of a ring entry; those around a vertex are in order.
  KOKKOS_INLINE_FUNCTION int ring_triangle(int entry) const {
    const int shift = to_place(triangle_body(entry / 3), 1);
    return place_ring_triangle(entry + 3 * shift) - shift;
  }
  /// Which corner of that triangle the vertex is: 0, 1, 2.
  KOKKOS_INLINE_FUNCTION int ring_corner(int entry) const { return place_ring_corner(entry + 3 * to_place(triangle_body(entry / 3), 1)); }
};

}  // namespace corpuscle
