#include "membrane/membrane_setup.hpp"

#include <cmath>
#include <map>
#include <string>

namespace corpuscle {

namespace {

auto label(const char* name) { return uninitialised(std::string("corpuscle::membrane::") + name); }

template <class T>
Array<T> to_device(const char* name, const std::vector<T>& values) {
  Array<T> view(label(name), values.size());
  auto host = Kokkos::create_mirror_view(view);
  for (std::size_t i = 0; i < values.size(); ++i) host(i) = values[i];
  Kokkos::deep_copy(view, host);
  return view;
}

/// The constants of all types that have the law; the others' places stay empty.
template <class Law>
Array<Law> constants(const std::vector<CellReference>& types) {
  std::vector<Law> laws;
  for (const CellReference& type : types) {
    const Law* law = std::get_if<Law>(&type.in_plane);
    laws.push_back(law ? *law : Law{});
  }
  return to_device("in_plane_law_type", laws);
}

/// @param law  whose kind counts
template <class Cells>
std::unique_ptr<Elasticity> elasticity_of(const MembraneLaw& law, const std::vector<CellReference>& types, const Cells& cells,
                                          const std::vector<int>& listed = {}) {
  return std::visit(
      [&](const auto& one) -> std::unique_ptr<Elasticity> {
        using Law = std::decay_t<decltype(one)>;
        return std::make_unique<ElasticityOf<Law, Cells>>(constants<Law>(types), cells, listed);
      },
      law);
}

}  // namespace

void fill_reference(MembraneViews& m, const std::vector<CellReference>& types, double size) {
  std::vector<CellLaw> law;
  std::vector<int> first{0};
  std::vector<double> rest_area;
  for (const CellReference& type : types) {
    law.push_back(type.law);
    law.back().rest_area *= size * size;
    law.back().rest_volume *= size * size * size;
    first.push_back(first.back() + int(type.mesh.triangles.size()));
    for (const double area : type.rest_area) rest_area.push_back(size * size * area);
  }
  m.law = to_device("law_type", law);
  m.type_first_triangle = to_device("type_first_triangle", first);
  m.rest_area = to_device("rest_area", rest_area);
  m.rest_length = Components<double>(label("rest_length"), rest_area.size(), 3);
  m.rest_cos = Components<double>(label("rest_cos"), rest_area.size(), 3);
  m.rest_sin = Components<double>(label("rest_sin"), rest_area.size(), 3);
  auto length = Kokkos::create_mirror_view(m.rest_length);
  auto cosine = Kokkos::create_mirror_view(m.rest_cos), sine = Kokkos::create_mirror_view(m.rest_sin);
  int t = 0;
  for (const CellReference& type : types) {
    for (std::size_t local = 0; local < type.rest_area.size(); ++local, ++t) {
      for (int k = 0; k < 3; ++k) {
        length(t, k) = size * type.rest_length[local][k];
        cosine(t, k) = std::cos(type.rest_angle[local][k]);
        sine(t, k) = std::sin(type.rest_angle[local][k]);
      }
    }
  }
  Kokkos::deep_copy(m.rest_length, length);
  Kokkos::deep_copy(m.rest_cos, cosine);
  Kokkos::deep_copy(m.rest_sin, sine);
}

MembraneViews make_membrane_views(const SurfaceSet& surface, const std::vector<CellReference>& types,
                                  const std::vector<int>& type_of_cell) {
  MembraneViews m;
  m.surface = surface;
  m.cells = int(type_of_cell.size());
  for (int type : type_of_cell) {
    m.vertices += int(types[type].mesh.vertices.size());
    m.triangles += int(types[type].mesh.triangles.size());
  }
  m.type = to_device("type_cell", type_of_cell);
  fill_reference(m, types);
  m.triangle_geometry = Table<double>(label("triangle_geometry"), m.triangles, 4);
  m.totals = Table<double>(label("totals_section"), m.cells * sections, 2);
  m.corner_force = Table<double>(label("corner_force"), m.triangles, 9);
  m.force = Components<double>(label("force_vertex"), m.vertices, 3);
  m.status = Array<int>("corpuscle::membrane::status", 1);
  return m;
}

std::unique_ptr<Elasticity> make_elasticity(const std::vector<CellReference>& types, const std::vector<int>& type_of_cell) {
  std::map<std::size_t, std::vector<int>> cells_of;  // by the law's place in MembraneLaw
  for (std::size_t c = 0; c < type_of_cell.size(); ++c) cells_of[types[type_of_cell[c]].in_plane.index()].push_back(int(c));
  if (cells_of.empty()) return std::make_unique<MixedElasticity>(std::vector<std::unique_ptr<Elasticity>>{});
  std::vector<std::unique_ptr<Elasticity>> parts;
  for (const auto& [law, cells] : cells_of) {
    const MembraneLaw& one = types[type_of_cell[cells[0]]].in_plane;
    if (cells_of.size() == 1) return elasticity_of(one, types, AllCells{int(cells.size())});
    parts.push_back(elasticity_of(one, types, ListedCells{to_device("cells_law", cells), int(cells.size())}, cells));
  }
  return std::make_unique<MixedElasticity>(std::move(parts));
}

MotionViews make_motion_views(const MembraneViews& m) {
  MotionViews w;
  w.direction = Components<double>("corpuscle::membrane::direction_vertex", m.vertices, 3);
  w.sums = Table<double>(label("motion_sums_section"), m.cells * sections, 2);
  w.volume = Array<double>(label("motion_volume_cell"), m.cells);
  return w;
}

StiffnessViews make_stiffness_views(const MembraneViews& m) {
  StiffnessViews w;
  w.mode = Components<double>(label("mode_vertex"), m.vertices, 3);
  w.probe = Components<double>(label("probe_vertex"), m.vertices, 3);
  w.force_ahead = Components<double>(label("force_ahead_vertex"), m.vertices, 3);
  w.force_behind = Components<double>(label("force_behind_vertex"), m.vertices, 3);
  w.sums = Table<double>(label("mode_sums_section"), m.cells * sections, 1);
  return w;
}

}  // namespace corpuscle
