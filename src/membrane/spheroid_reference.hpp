// A biconcave cell whose sheet rests on an oblate spheroid.
#pragma once

#include "membrane/reference.hpp"

namespace corpuscle {

/// Semi-axes (a, a, b), a >= b, of the oblate spheroid of that area (um2) and reduced volume 6 sqrt(pi) V / A^(3/2), 0.65
/// to 1.
Triple oblate_semi_axes(double area, double reduced_volume);

/// The biconcave mesh of the given diameter on the oblate spheroid: latitude by latitude, so that equal shares of area go to
/// equal shares of area; then scaled so that its triangles have the area of the mesh's.
TriangleMesh on_spheroid(const TriangleMesh& biconcave, double diameter_um, double reduced_volume);

/// Take the rest lengths and areas of a biconcave reference from the spheroid, and bring its mesh to rest.
/// @throws InputError  if it does not come to rest
void rest_on_spheroid(CellReference& reference, const CellSettings& cell);

}  // namespace corpuscle
