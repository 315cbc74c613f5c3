#include "membrane/mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "common/vec3.hpp"
#include "core/error.hpp"
#include "core/units.hpp"

namespace corpuscle {

namespace {

Vec3 vec(const Triple& a) { return {a[0], a[1], a[2]}; }

Vec3 area_vector(const TriangleMesh& mesh, const std::array<int, 3>& t) {
  const Vec3 a = vec(mesh.vertices[t[0]]);
  return 0.5 * cross(vec(mesh.vertices[t[1]]) - a, vec(mesh.vertices[t[2]]) - a);
}

[[noreturn]] void refuse(const std::string& name, const std::string& what, const std::string& remedy) {
  throw InputError(fmt::format("surface {}: {}; {}", name, what, remedy));
}

void check_vertices(const TriangleMesh& mesh, const std::string& name) {
  const int n = int(mesh.vertices.size());
  if (n < 4 || mesh.triangles.empty()) {
    refuse(name, fmt::format("{} vertices and {} triangles cannot enclose a volume", n, mesh.triangles.size()),
           "give a closed surface, a tetrahedron at the least");
  }
  for (int i = 0; i < n; ++i) {
    for (double c : mesh.vertices[i]) {
      if (!std::isfinite(c)) refuse(name, fmt::format("vertex {} has a coordinate that is not finite", i), "repair it");
    }
  }
  std::vector<char> used(n, 0);
  for (int t = 0; t < int(mesh.triangles.size()); ++t) {
    for (int i : mesh.triangles[t]) {
      if (i < 0 || i >= n) {
        refuse(name, fmt::format("triangle {} names vertex {}, but there are {} vertices", t, i, n), "vertices are counted from 0");
      }
      used[i] = 1;
    }
  }
  const auto lonely = std::find(used.begin(), used.end(), 0);
  if (lonely != used.end()) {
    refuse(name, fmt::format("vertex {} is isolated: no triangle uses it", lonely - used.begin()), "remove unused vertices");
  }
}

void check_areas(const TriangleMesh& mesh, const std::string& name) {
  const double mean = area(mesh) / double(mesh.triangles.size());
  for (int t = 0; t < int(mesh.triangles.size()); ++t) {
    const auto& c = mesh.triangles[t];
    // 1e-9 of the mean area: edges would differ by more than four orders of magnitude, beyond any usable mesh.
    if (!(norm(area_vector(mesh, c)) > 1e-9 * mean)) {
      refuse(name, fmt::format("triangle {} (vertices {}, {}, {}) is degenerate: its area is zero", t, c[0], c[1], c[2]),
             "remove it or merge its vertices");
    }
  }
}

void check_edges(const TriangleMesh& mesh, const std::string& name) {
  const auto sides = sorted_sides(mesh);
  for (std::size_t s = 0, e = 0; s < sides.size(); s = e) {
    while (e < sides.size() && sides[e].same_edge(sides[s])) ++e;
    const auto where = fmt::format("the edge between vertices {} and {}", sides[s].low, sides[s].high);
    if (e - s == 1) {
      refuse(name, fmt::format("open: {} belongs to triangle {} only", where, sides[s].triangle),
             "close the hole, every edge must be shared by exactly two triangles");
    }
    if (e - s > 2) {
      refuse(name, fmt::format("non-manifold: {} is shared by {} triangles", where, e - s),
             "split the surface there, every edge must be shared by exactly two triangles");
    }
    if (sides[s].rising == sides[s + 1].rising) {
      refuse(name,
             fmt::format("inconsistent orientation: triangles {} and {} run along {} in the same direction", sides[s].triangle,
                         sides[s + 1].triangle, where),
             "reverse the vertex order of one of them, all must be counter-clockwise seen from outside");
    }
  }
}

void check_fans(const TriangleMesh& mesh, const std::string& name) {
  const auto neighbours = triangle_neighbours(mesh);
  const auto rings = vertex_rings(mesh, neighbours);
  std::vector<int> valence(mesh.vertices.size(), 0);
  for (const auto& t : mesh.triangles) {
    for (int i : t) ++valence[i];
  }
  for (std::size_t i = 0; i < rings.size(); ++i) {
    if (int(rings[i].size()) != valence[i]) {
      refuse(name, fmt::format("non-manifold: vertex {} joins two fans of triangles that share no edge", i),
             "give each fan its own vertex");
    }
  }
  std::vector<char> reached(mesh.triangles.size(), 0);
  std::vector<int> front{0};
  reached[0] = 1;
  std::size_t count = 1;
  while (!front.empty()) {
    const int t = front.back();
    front.pop_back();
    for (int other : neighbours[t]) {
      if (!reached[other]) reached[other] = 1, front.push_back(other), ++count;
    }
  }
  if (count != mesh.triangles.size()) {
    refuse(name,
           fmt::format("more than one component: triangle {} is not connected to triangle 0",
                       std::find(reached.begin(), reached.end(), 0) - reached.begin()),
           "give each closed surface as a body of its own");
  }
}

}  // namespace

std::vector<TriangleSide> sorted_sides(const TriangleMesh& mesh) {
  std::vector<TriangleSide> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (int t = 0; t < int(mesh.triangles.size()); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int a = mesh.triangles[t][(k + 1) % 3], b = mesh.triangles[t][(k + 2) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), t, k, a < b});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const TriangleSide& a, const TriangleSide& b) {
    return std::tie(a.low, a.high, a.triangle, a.corner) < std::tie(b.low, b.high, b.triangle, b.corner);
  });
  return sides;
}

double area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) sum += norm(area_vector(mesh, t));
  return sum;
}

double volume(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return 0;
  const Vec3 origin = vec(mesh.vertices[0]);
  double sum = 0;
  for (const auto& t : mesh.triangles) sum += dot(vec(mesh.vertices[t[0]]) - origin, area_vector(mesh, t));
  return sum / 3;
}

void check_closed_surface(const TriangleMesh& mesh, const std::string& name) {
  check_vertices(mesh, name);
  check_areas(mesh, name);
  check_edges(mesh, name);
  check_fans(mesh, name);
  constexpr double flat = 1e-9;  // of a sphere's volume, at least
  const double size = std::pow(area(mesh), 1.5);
  if (std::abs(volume(mesh)) <= flat * size)
    refuse(name, fmt::format("flat: its volume is {:.6g} um3 and its area {:.6g} um2", volume(mesh), area(mesh)),
           "give a closed surface with room inside");
  if (!(volume(mesh) > 0)) {
    refuse(name, fmt::format("inside-out: its volume is {:.6g} um3", volume(mesh)),
           "reverse the vertex order of every triangle, they must be counter-clockwise seen from outside");
  }
}

TriangleMesh transform(const TriangleMesh& mesh, const Triple& axis, double spin_deg, const Triple& center) {
  const double length = norm(vec(axis));
  if (!(length > 0) || !std::isfinite(length)) {
    throw InputError(fmt::format("axis = [{}, {}, {}]: it must have a length; give e.g. [0, 0, 1]", axis[0], axis[1], axis[2]));
  }
  const Vec3 a = vec(axis) * (1 / length);
  const double cos_spin = std::cos(spin_deg * units::degree), sin_spin = std::sin(spin_deg * units::degree);
  // Rodrigues' rotation of z onto a about z x a; for a = -z the rotation by 180 degrees about x.
  const bool opposite = a.z < -1 + 1e-12;
  const Vec3 w{-a.y, a.x, 0};
  TriangleMesh out = mesh;
  for (Triple& p : out.vertices) {
    const Vec3 s{cos_spin * p[0] - sin_spin * p[1], sin_spin * p[0] + cos_spin * p[1], p[2]};
    const Vec3 r = opposite ? Vec3{s.x, -s.y, -s.z} : a.z * s + cross(w, s) + (dot(w, s) / (1 + a.z)) * w;
    p = {r.x + center[0], r.y + center[1], r.z + center[2]};
  }
  return out;
}

std::vector<std::array<int, 3>> triangle_neighbours(const TriangleMesh& mesh) {
  std::vector<std::array<int, 3>> neighbours(mesh.triangles.size());
  const auto sides = sorted_sides(mesh);
  for (std::size_t s = 0; s + 1 < sides.size(); s += 2) {
    neighbours[sides[s].triangle][sides[s].corner] = sides[s + 1].triangle;
    neighbours[sides[s + 1].triangle][sides[s + 1].corner] = sides[s].triangle;
  }
  return neighbours;
}

std::vector<std::vector<int>> vertex_rings(const TriangleMesh& mesh, const std::vector<std::array<int, 3>>& neighbours) {
  std::vector<std::vector<int>> rings(mesh.vertices.size());
  for (int first = 0; first < int(mesh.triangles.size()); ++first) {
    for (int i : mesh.triangles[first]) {
      if (!rings[i].empty()) continue;
      int t = first;
      do {
        rings[i].push_back(t);
        const auto& c = mesh.triangles[t];
        const int corner = c[0] == i ? 0 : (c[1] == i ? 1 : 2);
        t = neighbours[t][(corner + 1) % 3];  // across the side from the last corner back to i
      } while (t != first && rings[i].size() <= mesh.triangles.size());
    }
  }
  return rings;
}

}  // namespace corpuscle
