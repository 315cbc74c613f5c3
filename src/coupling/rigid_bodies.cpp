#include "coupling/rigid_bodies.hpp"

#include "common/vec3.hpp"
#include "immersed/surface_motion.hpp"
#include "membrane/mesh_generator.hpp"
#include "membrane/surface_file.hpp"

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

constexpr int fewest_vertices = 162, most_vertices = 100000;

/// Vertices for edges of about one grid spacing: a vertex of a triangulated surface stands for sqrt(3)/2 edge^2.
int suitable_vertices(const Triple& semi_axes, double spacing) {
  const double p = 1.6075;  // Thomsen's approximation of an ellipsoid's area
  const double a = std::pow(semi_axes[0], p), b = std::pow(semi_axes[1], p), c = std::pow(semi_axes[2], p);
  const double area = 4 * std::acos(-1.0) * std::pow((a * b + a * c + b * c) / 3, 1 / p);
  return std::clamp(static_cast<int>(area / (0.5 * std::sqrt(3.0) * spacing * spacing)), fewest_vertices, most_vertices);
}

/// Rotation by |omega| t about omega (Rodrigues).
void rotation_matrix(const Triple& omega, double t, double (&r)[3][3]) {
  const double rate = std::sqrt(omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2]);
  const double angle = rate * t, c = std::cos(angle), s = std::sin(angle);
  Triple n{0, 0, 1};
  if (rate > 0)
    for (int m = 0; m < 3; ++m) n[m] = omega[m] / rate;
  const double skew[3][3] = {{0, -n[2], n[1]}, {n[2], 0, -n[0]}, {-n[1], n[0], 0}};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r[i][j] = (i == j ? c : 0) + s * skew[i][j] + (1 - c) * n[i] * n[j];
}

}  // namespace

TriangleMesh make_body_mesh(const BodySettings& body, double spacing) {
  TriangleMesh mesh;
  if (body.shape == BodySettings::Shape::file) {
    mesh = read_body_surface(body).mesh;
  } else {
    const double a = body.radius_um;
    const Triple axes = body.shape == BodySettings::Shape::sphere ? Triple{a, a, a} : body.semi_axes_um;
    mesh = ellipsoid_mesh(axes, body.vertices > 0 ? body.vertices : suitable_vertices(axes, spacing));
  }
  return transform(mesh, body.axis, body.spin_deg, body.center_um);
}

RigidBodies::RigidBodies(const std::vector<BodySettings>& bodies, const SurfaceSet& surfaces, int first_body)
    : settings_(bodies), surfaces_(surfaces), reference_("corpuscle::immersed::reference", surfaces.vertices, 3) {
  Kokkos::deep_copy(reference_, surfaces.x);
  const auto first = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), surfaces.first_vertex);
  const auto x = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), surfaces.x);
  for (int b = 0; b <= count(); ++b) first_vertex_.push_back(first(first_body + b));
  for (int b = 0; b < count(); ++b) {
    centre_.push_back(bodies[b].center_um);
    double square = 0;
    for (int i = first_vertex_[b]; i < first_vertex_[b + 1]; ++i) {
      double r2 = 0;
      for (int m = 0; m < 3; ++m) r2 += std::pow(x(i, m) - bodies[b].center_um[m], 2);
      square = std::max(square, r2);
    }
    reach_.push_back(std::sqrt(square));
  }
}

void RigidBodies::move_to(double t) {
  for (int b = 0; b < count(); ++b) {
    const auto& s = settings_[b];
    for (int m = 0; m < 3; ++m) centre_[b][m] = s.center_um[m] + t * s.velocity_um_per_us[m];
    const auto vec = [](const Triple& a) { return Vec3{a[0], a[1], a[2]}; };
    RigidMotion motion{vec(s.center_um), vec(centre_[b]), vec(s.velocity_um_per_us), vec(s.angular_velocity_rad_per_us), {}};
    rotation_matrix(s.angular_velocity_rad_per_us, t, motion.rotation);
    move_rigid_body(surfaces_, first_vertex_[b], first_vertex_[b + 1], reference_, motion);
  }
}

double RigidBodies::largest_speed() const {
  double largest = 0;
  for (int b = 0; b < count(); ++b) {
    const auto& v = settings_[b].velocity_um_per_us;
    const auto& w = settings_[b].angular_velocity_rad_per_us;
    largest = std::max(largest, std::hypot(v[0], v[1], v[2]) + reach_[b] * std::hypot(w[0], w[1], w[2]));
  }
  return largest;
}

}  // namespace corpuscle
