#include "membrane/reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/error.hpp"
#include "core/log.hpp"
#include "core/units.hpp"
#include "membrane/coarse_graining.hpp"
#include "membrane/mesh_generator.hpp"
#include "membrane/spheroid_reference.hpp"
#include "membrane/surface_file.hpp"
#include "membrane/surface_shape.hpp"
#include "membrane/triangle_forces.hpp"

namespace corpuscle {

namespace {

void require(const CellSettings& cell, bool holds, const char* key, double value, const char* allowed) {
  if (!holds || !std::isfinite(value)) {
    throw InputError(fmt::format("{} = {}: {}", constant_key(cell, key), value, allowed));
  }
}

CellLaw make_law(const CellSettings& c) {
  const double eta = c.membrane_viscosity_N_s_per_m * units::N_s_per_m;
  require(c, c.mass_pg > 0, "mass_pg", c.mass_pg, "must be positive; a real cell weighs 27 to 121 pg");
  require(c, c.shear_modulus_uN_per_m > 0, "shear_modulus_uN_per_m", c.shear_modulus_uN_per_m,
          "must be positive; a healthy cell has 4 to 10");
  require(c, c.bending_modulus_fJ >= 0, "bending_modulus_fJ", c.bending_modulus_fJ, "must not be negative; a healthy cell has 2.4e-4");
  require(c, c.area_modulus_uN_per_m >= 0, "area_modulus_uN_per_m", c.area_modulus_uN_per_m, "must not be negative");
  require(c, c.volume_modulus_Pa >= 0, "volume_modulus_Pa", c.volume_modulus_Pa, "must not be negative");
  require(c, eta >= 0, "membrane_viscosity_N_s_per_m", c.membrane_viscosity_N_s_per_m,
          "must not be negative; measured values are about 0.5e-6");
  require(c, c.local_area_modulus_uN_per_m >= 0, "local_area_modulus_uN_per_m", c.local_area_modulus_uN_per_m, "must not be negative");
  require(c, c.law != CellSettings::Law::wlc_pow || c.local_area_modulus_uN_per_m > 0, "local_area_modulus_uN_per_m",
          c.local_area_modulus_uN_per_m,
          "must be positive with springs: without it triangles can collapse and the solution gets stuck; the model's value is "
          "4.82");
  CellLaw law;
  law.bending = 2 / std::sqrt(3.0) * c.bending_modulus_fJ;
  law.area = c.area_modulus_uN_per_m * units::uN_per_m;
  law.local_area = c.local_area_modulus_uN_per_m * units::uN_per_m;
  law.volume = c.volume_modulus_Pa * units::Pa;
  if (c.dissipation == CellSettings::Dissipation::central) {
    law.central_damping = 4 * eta / std::sqrt(3.0);  // a flat network's shear viscosity is then eta
  } else {
    law.tangential_damping = 12 * eta / (13 * std::sqrt(3.0));  // Equation 11
    law.central_damping = 4 * eta / (13 * std::sqrt(3.0));
  }
  return law;
}

MembraneLaw make_in_plane_law(const CellSettings& c) {
  const double modulus = c.shear_modulus_uN_per_m * units::uN_per_m;
  switch (c.law) {
    case CellSettings::Law::neo_hookean:
      return NeoHookean{{modulus}};
    case CellSettings::Law::skalak:
      require(c, c.skalak_c >= 0, "skalak_c", c.skalak_c, "must not be negative; capsules have about 1, red cells 10 and more");
      return Skalak{{modulus, c.skalak_c}};
    default:
      return WlcPow{{modulus / shear_modulus_over_stiffness()}};
  }
}

double size_factor(const CellSettings& c) { return c.diameter_um / BiconcaveShape::D0; }

TriangleMesh make_mesh(const CellSettings& c) {
  if (!c.mesh.empty()) return read_cell_surface(c).mesh;
  if (c.shape == CellSettings::Shape::sphere) return ellipsoid_mesh({c.radius_um, c.radius_um, c.radius_um}, c.vertices);
  if (c.shape == CellSettings::Shape::ellipsoid) return ellipsoid_mesh(c.semi_axes_um, c.vertices);
  TriangleMesh mesh = biconcave_mesh(c.vertices);
  for (Triple& p : mesh.vertices)
    for (double& x : p) x *= size_factor(c);
  return mesh;
}

/// Lengths, signed angles and areas of the mesh as it is.
void measure(CellReference& r) {
  const auto& mesh = r.mesh;
  const auto neighbours = triangle_neighbours(mesh);
  const auto at = [&](int i) { return Vec3{mesh.vertices[i][0], mesh.vertices[i][1], mesh.vertices[i][2]}; };
  const auto twice_area = [&](int t) {
    const auto& c = mesh.triangles[t];
    return cross(at(c[1]) - at(c[0]), at(c[2]) - at(c[0]));
  };
  for (int t = 0; t < int(mesh.triangles.size()); ++t) {
    const Vec3 n = twice_area(t);
    std::array<double, 3> length, angle;
    for (int k = 0; k < 3; ++k) {
      const Vec3 side = at(mesh.triangles[t][(k + 2) % 3]) - at(mesh.triangles[t][(k + 1) % 3]);
      const Vec3 other = twice_area(neighbours[t][k]);
      length[k] = norm(side);
      angle[k] = std::atan2(dot(cross(n, other), side) / length[k], dot(n, other));
    }
    r.rest_length.push_back(length);
    r.rest_angle.push_back(angle);
    r.rest_area.push_back(0.5 * norm(n));
  }
  r.law.rest_area = area(mesh);
  r.law.rest_volume = volume(mesh);
}

double smallest_vertex_area(const TriangleMesh& mesh) {
  const auto at = [&](int i) { return Vec3{mesh.vertices[i][0], mesh.vertices[i][1], mesh.vertices[i][2]}; };
  std::vector<double> share(mesh.vertices.size(), 0);
  for (const auto& t : mesh.triangles)
    for (int i : t) share[i] += norm(cross(at(t[1]) - at(t[0]), at(t[2]) - at(t[0]))) / 6;
  return *std::min_element(share.begin(), share.end());
}

/// Triangles that the mesh has smaller than half of what they rest on are pushed open from the first step on.
void warn_of_squeezed(const CellReference& r, const CellSettings& cell) {
  int squeezed = 0;
  double least = 1;
  const auto at = [&](int i) { return Vec3{r.mesh.vertices[i][0], r.mesh.vertices[i][1], r.mesh.vertices[i][2]}; };
  for (std::size_t t = 0; t < r.mesh.triangles.size(); ++t) {
    const auto [a, b, c] = r.mesh.triangles[t];
    const double ratio = 0.5 * norm(cross(at(b) - at(a), at(c) - at(a))) / r.rest_area[t];
    squeezed += ratio < BendingShare::whole;
    least = std::min(least, ratio);
  }
  if (squeezed == 0) return;
  warn(
      "{}: {} of the {} triangles of the mesh have less than half of the area that they rest on (down to {:.2g} of it): they start "
      "squeezed, are pushed "
      "open and bend less; use reference = \"shape\", or a mesh whose triangles are more alike",
      constant_key(cell, "reference"), squeezed, r.mesh.triangles.size(), least);
}

auto type_key(const CellSettings& c) {
  return std::tie(c.vertices, c.shape, c.diameter_um, c.radius_um, c.semi_axes_um, c.mesh, c.scale, c.recenter, c.align, c.mass_pg, c.law,
                  c.skalak_c, c.reference, c.reference_reduced_volume, c.inflation, c.shear_modulus_uN_per_m, c.bending_modulus_fJ,
                  c.area_modulus_uN_per_m, c.local_area_modulus_uN_per_m, c.volume_modulus_Pa, c.membrane_viscosity_N_s_per_m,
                  c.viscosity_ratio, c.dissipation);
}

}  // namespace

CellReference make_reference(const CellSettings& cell) {
  CellReference r;
  r.law = make_law(cell);
  r.in_plane = make_in_plane_law(cell);
  r.mesh = make_mesh(cell);
  r.viscosity_ratio = cell.viscosity_ratio;
  const int vertices = int(r.mesh.vertices.size());
  r.law.vertex_mass = cell.mass_pg / vertices;
  measure(r);
  if (cell.reference != CellSettings::Reference::shape) {
    const double angle = spontaneous_angle(vertices);
    for (auto& a : r.rest_angle) a = {angle, angle, angle};
  }
  if (cell.reference == CellSettings::Reference::uniform) {
    if (cell.mesh.empty() && cell.shape == CellSettings::Shape::biconcave) {
      r.law.rest_area = 135 * std::pow(size_factor(cell), 2);  // Table 1
      r.law.rest_volume = 94 * std::pow(size_factor(cell), 3);
    }
    const double length = uniform_edge_length(r.law.rest_area, vertices);
    for (auto& l : r.rest_length) l = {length, length, length};
    std::fill(r.rest_area.begin(), r.rest_area.end(), r.law.rest_area / double(r.mesh.triangles.size()));
  }
  if (cell.reference == CellSettings::Reference::spheroid) rest_on_spheroid(r, cell);
  if (cell.inflation > 0) {
    const double shrink = 1 / (1 + cell.inflation);
    for (auto& l : r.rest_length)
      for (double& side : l) side *= shrink;
    for (double& a : r.rest_area) a *= shrink * shrink;
  }
  r.smallest_vertex_area = smallest_vertex_area(r.mesh);
  warn_of_squeezed(r, cell);
  return r;
}

TriangleMesh stretched(TriangleMesh mesh, const Triple& factors) {
  if (factors == Triple{1, 1, 1}) return mesh;
  const double whole = std::cbrt(factors[0] * factors[1] * factors[2]);
  for (Triple& p : mesh.vertices)
    for (int d = 0; d < 3; ++d) p[d] *= factors[d] / whole;
  return mesh;
}

TriangleMesh placed_mesh(const CellReference& reference, const CellSettings& cell) {
  return transform(stretched(reference.mesh, cell.start_stretch), cell.axis, cell.spin_deg, cell.center_um);
}

bool same_type(const CellSettings& a, const CellSettings& b) { return type_key(a) == type_key(b); }

std::string stretch_text(const MembraneLaw& law, double strain) {
  if (std::holds_alternative<WlcPow>(law)) return fmt::format("a link at {:.3f} of its contour length", strain);
  return fmt::format("a triangle stretched {:.3g} times, where its law holds to {:g}", strain, strain_limit(law));
}

}  // namespace corpuscle
