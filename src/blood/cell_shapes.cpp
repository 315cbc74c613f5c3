#include "blood/cell_shapes.hpp"

namespace corpuscle {

namespace {

/// Vertices of a mesh around their mean, mapped so that their second moments are the same in all directions.
std::vector<Vec3> even_places(const TriangleMesh& mesh) {
  std::vector<Vec3> places;
  Vec3 mean;
  for (const Triple& x : mesh.vertices) {
    places.push_back({x[0], x[1], x[2]});
    mean += (1.0 / static_cast<double>(mesh.vertices.size())) * places.back();
  }
  double second[3][3] = {};
  for (Vec3& x : places) {
    x -= mean;
    for (int d = 0; d < 3; ++d)
      for (int e = 0; e < 3; ++e) second[d][e] += x[d] * x[e];
  }
  const SymmetricEigen axes = eigen_of(second);
  for (Vec3& x : places) {
    Vec3 mapped;
    for (int n = 0; n < 3; ++n) mapped += (dot(x, axes.vector[n]) / std::sqrt(axes.value[n])) * axes.vector[n];
    x = mapped;
  }
  return places;
}

MaterialViews make_material(const std::vector<CellReference>& types) {
  std::vector<Vec3> all;
  MaterialViews material;
  material.first = Array<int>("corpuscle::blood::material_first", types.size());
  const auto first = Kokkos::create_mirror_view(material.first);
  for (std::size_t k = 0; k < types.size(); ++k) {
    first(k) = static_cast<int>(all.size());
    const auto places = even_places(types[k].mesh);
    all.insert(all.end(), places.begin(), places.end());
  }
  Kokkos::deep_copy(material.first, first);
  material.place = Components<double>(uninitialised("corpuscle::blood::material_place"), all.size(), 3);
  const auto place = Kokkos::create_mirror_view(material.place);
  for (std::size_t i = 0; i < all.size(); ++i)
    for (int d = 0; d < 3; ++d) place(i, d) = all[i][d];
  Kokkos::deep_copy(material.place, place);
  return material;
}

}  // namespace

CellShapes::CellShapes(const std::vector<CellReference>& types, const FlowFrame* frame) : material_(make_material(types)) {
  columns_ = {"deformation"};
  if (!frame || !frame->guided()) return;
  frame_ = *frame;
  for (const char* name : {"inclination_deg", "membrane_angle_deg", "tank_treading_deg"}) columns_.emplace_back(name);
}

const std::vector<std::vector<double>>& CellShapes::measure(const SurfaceSet& set, int cells, const Array<int>& type) {
  if (const auto rows = static_cast<std::size_t>(cells); !table_.data() || table_.extent(0) < rows) {
    table_ = Table<double>(uninitialised("corpuscle::blood::shapes"), rows + rows / 10 + 1, ShapeColumn::count);
    host_ = HostCopy(table_);
  }
  if (cells > 0) measure_shapes(set, cells, type, material_, frame_, table_);
  const auto& host = host_.read();
  rows_.resize(cells);
  for (int c = 0; c < cells; ++c) rows_[c].assign(&host(c, 0), &host(c, 0) + columns_.size());
  return rows_;
}

}  // namespace corpuscle
