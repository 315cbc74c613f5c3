#include "membrane/mesh_repair.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "common/vec3.hpp"

namespace corpuscle {

namespace {

/// First vertices of their kind, found by place: in cubes of a few times the distance within which places are the same.
class PlaceTable {
 public:
  PlaceTable(const TriangleMesh& mesh, double near) : mesh_(mesh), near_(near), cube_(4 * near) {}

  /// The vertex known at p, or -1.
  int find(const Triple& p) const {
    std::int64_t low[3], high[3];
    for (int d = 0; d < 3; ++d) low[d] = cube(p[d] - near_), high[d] = cube(p[d] + near_);
    int found = -1;
    for (std::int64_t i = low[0]; i <= high[0]; ++i)
      for (std::int64_t j = low[1]; j <= high[1]; ++j)
        for (std::int64_t k = low[2]; k <= high[2]; ++k) {
          const auto [begin, end] = known_.equal_range(key(i, j, k));
          for (auto it = begin; it != end; ++it)
            if (same(p, mesh_.vertices[it->second]) && (found < 0 || it->second < found)) found = it->second;
        }
    return found;
  }
  void add(int vertex) {
    const Triple& p = mesh_.vertices[vertex];
    known_.emplace(key(cube(p[0]), cube(p[1]), cube(p[2])), vertex);
  }

 private:
  std::int64_t cube(double x) const { return std::int64_t(std::floor(x / cube_)); }
  static std::uint64_t key(std::int64_t i, std::int64_t j, std::int64_t k) {
    return std::uint64_t(i) * 0x9E3779B97F4A7C15u ^ std::uint64_t(j) * 0xC2B2AE3D27D4EB4Fu ^ std::uint64_t(k) * 0x165667B19E3779F9u;
  }
  bool same(const Triple& p, const Triple& q) const {
    return std::abs(p[0] - q[0]) <= near_ && std::abs(p[1] - q[1]) <= near_ && std::abs(p[2] - q[2]) <= near_;
  }

  const TriangleMesh& mesh_;
  double near_, cube_;
  std::unordered_multimap<std::uint64_t, int> known_;
};

/// Number the vertices marked in `kept` anew, in order, and take the others out.
void keep_vertices(TriangleMesh& mesh, const std::vector<char>& kept, std::vector<int> number) {
  std::vector<int> place(mesh.vertices.size(), -1);
  std::vector<Triple> vertices;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (!kept[i]) continue;
    place[i] = int(vertices.size());
    vertices.push_back(mesh.vertices[i]);
  }
  for (auto& t : mesh.triangles)
    for (int& i : t) i = place[number[i]];
  mesh.vertices = std::move(vertices);
}

}  // namespace

bool is_open(const TriangleMesh& mesh) {
  const auto sides = sorted_sides(mesh);
  for (std::size_t s = 0, e = 0; s < sides.size(); s = e) {
    while (e < sides.size() && sides[e].same_edge(sides[s])) ++e;
    if (e - s == 1) return true;
  }
  return false;
}

void merge_coincident(TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return;
  constexpr double rounding = 1e-6;  // of the size: coordinates written with seven digits
  double size = 0;
  for (const Triple& p : mesh.vertices)
    for (int d = 0; d < 3; ++d) size = std::max(size, std::abs(p[d] - mesh.vertices[0][d]));
  if (!(size > 0)) return;
  PlaceTable table(mesh, rounding * size);
  std::vector<int> first(mesh.vertices.size());
  std::vector<char> kept(mesh.vertices.size(), 0);
  for (int i = 0; i < int(first.size()); ++i) {
    first[i] = table.find(mesh.vertices[i]);
    if (first[i] >= 0) continue;
    first[i] = i;
    kept[i] = 1;
    table.add(i);
  }
  keep_vertices(mesh, kept, first);
}

void drop_collapsed(MeshFile& file) {
  auto& triangles = file.mesh.triangles;
  std::vector<std::array<int, 3>> whole;
  std::vector<int> part;
  std::vector<char> used(file.mesh.vertices.size(), 0);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto& c = triangles[t];
    if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) continue;
    for (int i : c) used[i] = 1;
    whole.push_back(c);
    if (!file.part.empty()) part.push_back(file.part[t]);
  }
  const auto collapsed = triangles.size() - whole.size();
  const auto unused = std::count(used.begin(), used.end(), 0);
  if (collapsed == 0 && unused == 0) return;
  if (collapsed > 0) file.notes.push_back(fmt::format("{} triangles with two corners in one place are left out", collapsed));
  if (unused > 0) file.notes.push_back(fmt::format("{} vertices that no triangle uses are left out", unused));
  triangles = std::move(whole);
  file.part = std::move(part);
  std::vector<int> same(used.size());
  for (std::size_t i = 0; i < same.size(); ++i) same[i] = int(i);
  keep_vertices(file.mesh, used, std::move(same));
}

namespace {

struct Neighbour {
  int triangle;
  bool agrees;  // runs along the common edge in the opposite direction, as it should
};

std::vector<std::vector<Neighbour>> neighbours_over_edges(const TriangleMesh& mesh, bool pairs_only) {
  std::vector<std::vector<Neighbour>> neighbours(mesh.triangles.size());
  const auto sides = sorted_sides(mesh);
  for (std::size_t s = 0, e = 0; s < sides.size(); s = e) {
    while (e < sides.size() && sides[e].same_edge(sides[s])) ++e;
    if (pairs_only && e - s != 2) continue;
    for (std::size_t k = s + 1; k < e; ++k) {
      const bool agrees = sides[k].rising != sides[k - 1].rising;
      neighbours[sides[k].triangle].push_back({sides[k - 1].triangle, agrees});
      neighbours[sides[k - 1].triangle].push_back({sides[k].triangle, agrees});
    }
  }
  return neighbours;
}

/// Visit every triangle, neighbours after neighbours: visit(triangle, the one it was reached from or -1, agrees).
template <class Visit>
void walk(const std::vector<std::vector<Neighbour>>& neighbours, const Visit& visit) {
  std::vector<char> reached(neighbours.size(), 0);
  std::vector<int> front;
  for (int start = 0; start < int(neighbours.size()); ++start) {
    if (reached[start]) continue;
    reached[start] = 1;
    visit(start, -1, true);
    front.push_back(start);
    while (!front.empty()) {
      const int t = front.back();
      front.pop_back();
      for (const Neighbour& n : neighbours[t]) {
        if (reached[n.triangle]) continue;
        reached[n.triangle] = 1;
        visit(n.triangle, t, n.agrees);
        front.push_back(n.triangle);
      }
    }
  }
}

}  // namespace

std::vector<int> connected_pieces(const TriangleMesh& mesh) {
  std::vector<int> piece(mesh.triangles.size(), 0);
  int pieces = 0;
  walk(neighbours_over_edges(mesh, false), [&](int t, int from, bool) { piece[t] = from < 0 ? pieces++ : piece[from]; });
  return piece;
}

int orient_outward(TriangleMesh& mesh) {
  std::vector<char> turned(mesh.triangles.size(), 0);
  std::vector<int> piece(mesh.triangles.size(), 0);
  int pieces = 0;
  walk(neighbours_over_edges(mesh, true), [&](int t, int from, bool agrees) {
    piece[t] = from < 0 ? pieces++ : piece[from];
    turned[t] = from < 0 ? 0 : (agrees ? turned[from] : !turned[from]);
  });
  std::vector<double> volume(pieces, 0);
  const auto at = [&](int i) { return Vec3{mesh.vertices[i][0], mesh.vertices[i][1], mesh.vertices[i][2]}; };
  const Vec3 origin = mesh.vertices.empty() ? Vec3{} : at(0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& c = mesh.triangles[t];
    const double own = dot(at(c[0]) - origin, cross(at(c[1]) - origin, at(c[2]) - origin));
    volume[piece[t]] += turned[t] ? -own : own;
  }
  int count = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (bool(turned[t]) == (volume[piece[t]] < 0)) continue;
    std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
    ++count;
  }
  return count;
}

}  // namespace corpuscle
