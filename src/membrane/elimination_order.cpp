#include "membrane/elimination_order.hpp"

#include <algorithm>
#include <cstdlib>

namespace corpuscle {

namespace {

using Neighbours = std::vector<std::vector<int>>;

Neighbours neighbours_of(const TriangleMesh& mesh) {
  Neighbours all(mesh.vertices.size());
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      all[t[k]].push_back(t[(k + 1) % 3]);
      all[t[(k + 1) % 3]].push_back(t[k]);
    }
  for (auto& own : all) {
    std::sort(own.begin(), own.end());
    own.erase(std::unique(own.begin(), own.end()), own.end());
  }
  return all;
}

/// All vertices, outward from one; of several with the same neighbour those with fewest neighbours first.
std::vector<int> outward(const Neighbours& neighbours, int start) {
  std::vector<int> order{start};
  std::vector<bool> seen(neighbours.size(), false);
  seen[start] = true;
  for (std::size_t next = 0, other = 0; order.size() < neighbours.size(); ++next) {
    if (next == order.size()) {  // a part that nothing leads to
      while (seen[other]) ++other;
      seen[other] = true;
      order.push_back(static_cast<int>(other));
    }
    const std::size_t from = order.size();
    for (int v : neighbours[order[next]])
      if (!seen[v]) seen[v] = true, order.push_back(v);
    std::stable_sort(order.begin() + static_cast<std::ptrdiff_t>(from), order.end(),
                     [&](int a, int b) { return neighbours[a].size() < neighbours[b].size(); });
  }
  return order;
}

}  // namespace

EliminationOrder elimination_order(const TriangleMesh& mesh) {
  EliminationOrder result;
  if (mesh.vertices.empty()) return result;
  const Neighbours neighbours = neighbours_of(mesh);
  constexpr int turns = 4;  // from one end to the other
  std::vector<int> order = outward(neighbours, 0);
  for (int turn = 0; turn < turns; ++turn) order = outward(neighbours, order.back());
  result.place.resize(order.size());
  for (std::size_t p = 0; p < order.size(); ++p) result.place[order[p]] = static_cast<int>(p);
  for (std::size_t v = 0; v < neighbours.size(); ++v)
    for (int other : neighbours[v]) result.width = std::max(result.width, std::abs(result.place[v] - result.place[other]));
  return result;
}

}  // namespace corpuscle
