// What immersed bodies impose on the flow solver.
#pragma once

#include "immersed/faces.hpp"
#include "immersed/reconstruct.hpp"

namespace corpuscle {

/// Rows of the immersed nodes that this rank owns, and the faces between them and the fluid.
struct EmbeddedBodies {
  int rows = 0;                  // in use, of the row arrays
  StencilViews velocity;         // u_row = surface_weight u_surface + sum of weight u[column]
  Components<double> u_surface;  // [row, 3] surface velocity, um/us
  StencilViews pressure;         // p_row = sum of weight p[column]
  int bodies = 0;
  FaceViews faces;       // sorted by body
  Images images;         // shifts that faces.image numbers, um
  Array<double> growth;  // [body] rate of change of its volume, um3/us
};

}  // namespace corpuscle
