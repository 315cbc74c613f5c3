// The closed triangulated surfaces immersed in the fluid, all bodies in one set of arrays. Membranes and rigid bodies
// both appear to the fluid as this.
#pragma once

#include "common/types.hpp"

namespace corpuscle {

constexpr int no_vertex = 1 << 30;

/// Vertices and triangles are numbered over all bodies; triangles are counter-clockwise seen from outside. Every rank holds all
/// surfaces, or those that reach into its block (SharedCells): then copies of other ranks' cells, and of its own where a
/// periodic side brings them back, follow its own cells, shifted to where this block sees them. Arrays may have room for more
/// than there is.
struct SurfaceSet {
  int bodies = 0, vertices = 0, triangles = 0;
  int cells = 0;              // the first bodies are membranes, the others rigid
  int own_cells = 0;          // the first membranes are this rank's own, the others copies
  int own_vertices = 0;       // of them
  Array<int> number;          // [body] of the cell in the whole scene, the same for its copies; of a rigid body among those
  Components<double> x;       // [vertex, 3] um
  Components<double> v;       // [vertex, 3] um/us
  Components<double> normal;  // [vertex, 3] outward unit normal, area weighted
  Array<double> area;         // [vertex] a third of the areas of its triangles, um2
  Table<int> triangle;        // [triangle, 3] vertex numbers
  Table<int> neighbour;       // [triangle, 3] triangle across the edge opposite corner 0, 1, 2
  Array<int> vertex_body;     // [vertex] body number
  Array<int> triangle_body;   // [triangle]
  Array<int> first_vertex;    // [bodies + 1]
  Array<int> first_triangle;  // [bodies + 1]
  Array<int> ring_start;      // [vertices + 1] into ring_triangle
  Array<int> ring_triangle;   // triangles around each vertex, in order
  Array<std::int8_t> ring_corner;  // [as ring_triangle] which corner of that triangle the vertex is: 0, 1, 2
};

}  // namespace corpuscle
