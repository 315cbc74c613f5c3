// A spherical capsule in shear between walls, and Taylor's deformation.
#pragma once

#include "membrane/inertia.hpp"
#include "scenes.hpp"

namespace corpuscle::scenes {

/// Lengths in radii, times over the shear rate.
struct ShearedCapsule {
  CellSettings::Law law = CellSettings::Law::neo_hookean;
  double capillary = 0.3;  // outer viscosity x shear rate x radius / shear modulus
  double viscosity_ratio = 1;
  double cells_per_radius = 5;  // of the grid
  double box = 8;               // walls and images from each other
  int vertices = 500;
  CouplingSettings::Kernel kernel = CouplingSettings::Kernel::three_point;
  bool slip = true;
  double step = 0.01;

  static constexpr double radius_um = 3, viscosity = 1.1, rate = 1e-4;  // mPa s, 1/us

  Case scene(double until) const {
    Case scene;
    scene.time = {step / rate, until / rate};
    scene.grid = cube(box * radius_um, static_cast<int>(std::lround(box * cells_per_radius)));
    scene.fluid = FluidSettings{};
    scene.fluid->kinematic_viscosity_um2_per_us = viscosity;
    scene.fluid->density_pg_per_um3 = 1;
    scene.fluid->convection = FluidSettings::Convection::none;
    scene.boundaries = sides(BoundarySettings::Type::periodic);
    for (int side : {2, 3}) {
      scene.boundaries[side].type = BoundarySettings::Type::moving_wall;
      scene.boundaries[side].velocity = Triple{(side == 2 ? -0.5 : 0.5) * box * radius_um * rate, 0, 0};
    }
    CellSettings cell;
    cell.shape = CellSettings::Shape::sphere;
    cell.radius_um = radius_um;
    cell.vertices = vertices;
    cell.law = law;
    cell.viscosity_ratio = viscosity_ratio;
    cell.shear_modulus_uN_per_m = 1e3 * viscosity * rate * radius_um / capillary;
    cell.bending_modulus_fJ = cell.area_modulus_uN_per_m = cell.local_area_modulus_uN_per_m = 0;
    scene.cells = {cell};
    scene.coupling = CouplingSettings{};
    scene.coupling->scheme = CouplingSettings::Scheme::force;
    scene.coupling->kernel = kernel;
    scene.coupling->slip = slip;
    return scene;
  }
};

struct Deformation {
  double taylor = 0;     // (L - B) / (L + B) of the ellipsoid of equal inertia, in the plane of the shear
  double angle_deg = 0;  // of its long axis to the flow
};

inline Deformation deformation(const TriangleMesh& mesh) {
  const PrincipalAxes axes = principal_axes(mesh);
  int across = 0;  // of the plane
  for (int d = 1; d < 3; ++d)
    if (std::abs(axes.axis[d][2]) > std::abs(axes.axis[across][2])) across = d;
  const int small = across == 0 ? 1 : 0, large = across == 2 ? 1 : 2;
  const double b = std::sqrt(axes.moment[small]), l = std::sqrt(axes.moment[large]);
  const double slope = std::atan(axes.axis[large][1] / axes.axis[large][0]) * 180 / std::acos(-1.0);
  return {(l - b) / (l + b), slope};
}

}  // namespace corpuscle::scenes
