#include "membrane/mesh_relaxation.hpp"

#include <algorithm>
#include <cmath>

namespace corpuscle {

namespace {

/// A closed mesh whose edges can be flipped in place.
class FlipMesh {
 public:
  explicit FlipMesh(TriangleMesh& mesh)
      : mesh_(mesh), triangle_(mesh.triangles), neighbour_(triangle_neighbours(mesh)), valence_(mesh.vertices.size()) {
    for (const auto& t : triangle_) {
      for (int i : t) ++valence_[i];
    }
  }

  Vec3 at(int i) const { return {mesh_.vertices[i][0], mesh_.vertices[i][1], mesh_.vertices[i][2]}; }

  /// Sweep over the edges, flipping those with cot(alpha) + cot(beta) < 0, until none is left (or after `sweeps`).
  void make_delaunay(int sweeps) {
    for (int s = 0; s < sweeps; ++s) {
      int flips = 0;
      for (int t = 0; t < int(triangle_.size()); ++t) {
        for (int k = 0; k < 3; ++k) {
          if (neighbour_[t][k] < t) continue;
          if (edge_cotangents(t, k) < -1e-9 && flip_keeps_shape(t, k)) flip(t, k), ++flips;
        }
      }
      if (flips == 0) break;
    }
  }

 private:
  int corner_facing(int t, int other) const { return neighbour_[t][0] == other ? 0 : (neighbour_[t][1] == other ? 1 : 2); }

  double cotangent(int apex, int a, int b) const {
    const Vec3 u = at(a) - at(apex), v = at(b) - at(apex);
    return dot(u, v) / std::max(norm(cross(u, v)), 1e-300);
  }

  double edge_cotangents(int t, int k) const {
    const int o = neighbour_[t][k], j = corner_facing(o, t);
    const auto &c = triangle_[t], &d = triangle_[o];
    return cotangent(c[k], c[(k + 1) % 3], c[(k + 2) % 3]) + cotangent(d[j], d[(j + 1) % 3], d[(j + 2) % 3]);
  }

  /// The flipped pair must exist as two proper triangles facing the same way as before, and valences stay in 4..8.
  bool flip_keeps_shape(int t, int k) const {
    const int o = neighbour_[t][k], j = corner_facing(o, t);
    const int c = triangle_[t][k], a = triangle_[t][(k + 1) % 3], b = triangle_[t][(k + 2) % 3], d = triangle_[o][j];
    if (valence_[a] <= 4 || valence_[b] <= 4 || valence_[c] >= 8 || valence_[d] >= 8) return false;
    const Vec3 before = cross(at(b) - at(a), at(c) - at(a)) + cross(at(a) - at(b), at(d) - at(b));
    const Vec3 first = cross(at(a) - at(c), at(d) - at(c)), second = cross(at(d) - at(c), at(b) - at(c));
    const double scale = dot(before, before);
    return dot(first, before) > 0.02 * scale && dot(second, before) > 0.02 * scale;
  }

  /// Triangles (c, a, b) and (d, b, a) become (c, a, d) and (d, b, c).
  void flip(int t, int k) {
    const int o = neighbour_[t][k], j = corner_facing(o, t);
    const int c = triangle_[t][k], a = triangle_[t][(k + 1) % 3], b = triangle_[t][(k + 2) % 3], d = triangle_[o][j];
    const int bc = neighbour_[t][(k + 1) % 3], ca = neighbour_[t][(k + 2) % 3];
    const int ad = neighbour_[o][(j + 1) % 3], db = neighbour_[o][(j + 2) % 3];
    triangle_[t] = {c, a, d};
    neighbour_[t] = {ad, o, ca};
    triangle_[o] = {d, b, c};
    neighbour_[o] = {bc, t, db};
    neighbour_[ad][corner_facing(ad, o)] = t;
    neighbour_[bc][corner_facing(bc, t)] = o;
    --valence_[a], --valence_[b], ++valence_[c], ++valence_[d];
  }

  TriangleMesh& mesh_;
  std::vector<std::array<int, 3>>& triangle_;
  std::vector<std::array<int, 3>> neighbour_;
  std::vector<int> valence_;
};

/// One step of springs of rest length `rest` on every edge; those longer than it pull only if `two_sided`.
/// @return the largest move over the rest length
double spring_step(TriangleMesh& mesh, const SurfaceShape& shape, double rest, double rate, bool two_sided, std::vector<Vec3>& force) {
  std::fill(force.begin(), force.end(), Vec3{});
  const auto at = [&](int i) { return Vec3{mesh.vertices[i][0], mesh.vertices[i][1], mesh.vertices[i][2]}; };
  for (const auto& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      if (t[k] > t[(k + 1) % 3]) continue;  // each edge once, from the triangle that runs it upwards
      const Vec3 d = at(t[(k + 1) % 3]) - at(t[k]);
      const double length = norm(d);
      if (!two_sided && length > rest) continue;
      const Vec3 f = ((rest - length) / length) * d;
      force[t[k]] -= f;
      force[t[(k + 1) % 3]] += f;
    }
  }
  double largest = 0;
  for (std::size_t i = 0; i < force.size(); ++i) {
    Vec3 move = rate * force[i];
    const double size = norm(move);
    if (size > 0.2 * rest) move *= 0.2 * rest / size;
    largest = std::max(largest, norm(move) / rest);
    const Vec3 p = shape.project(at(int(i)) + move);
    mesh.vertices[i] = {p.x, p.y, p.z};
  }
  return largest;
}

}  // namespace

void relax_mesh(TriangleMesh& mesh, const SurfaceShape& shape) {
  FlipMesh flips(mesh);
  std::vector<Vec3> force(mesh.vertices.size());
  flips.make_delaunay(20);
  const double mean = std::sqrt(4 * shape.area() / (std::sqrt(3.0) * double(mesh.triangles.size())));
  // Repulsion from springs 1.2 times too long evens the density; two-sided springs then even the lengths.
  for (int phase = 0; phase < 2; ++phase) {
    for (int step = 0; step < (phase == 0 ? 700 : 150); ++step) {
      const double moved = spring_step(mesh, shape, phase == 0 ? 1.2 * mean : mean, 0.2, phase == 1, force);
      if (step % 5 == 4) flips.make_delaunay(3);
      if (moved < 1e-4) break;
    }
  }
  flips.make_delaunay(20);
}

}  // namespace corpuscle
