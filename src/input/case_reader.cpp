// Parses a case file, hands its sections to their readers and checks the whole. flow_sections.cpp and body_sections.cpp
// read the keys, section.cpp checks types and ranges, case_checks.cpp what spans several sections.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "core/error.hpp"
#include "core/nearest.hpp"
#include "input/case_checks.hpp"
#include "input/case_file.hpp"
#include "input/overrides.hpp"
#include "input/sections.hpp"
#include "input/unusual_values.hpp"

namespace corpuscle {
namespace {

// Hands out the sections of one case file and gathers their echo.
class CaseReader {
 public:
  CaseReader(const CaseFile& file, const std::vector<std::string>& overrides) {
    source_.file = file.path;
    const bool piped = file.path.rfind("/dev/", 0) == 0 || file.path.rfind("/proc/", 0) == 0;  // beside the user, then
    source_.folder = piped ? "" : std::filesystem::path(file.path).parent_path().string();
    parse(file);
    source_.overrides = apply_overrides(root_, overrides);
    check_section_names();
  }

  Case read() {
    Case scene;
    scene.path = source_.file;
    read_title(scene);
    if (root_.contains("grid")) scene.grid = one<GridSettings>("grid", read_grid);
    if (root_.contains("fluid")) scene.fluid = one<FluidSettings>("fluid", read_fluid);
    each("boundary", [&](Section& s) { scene.boundaries.push_back(read_boundary(s)); });
    const bool placed = scene.fluid.has_value();
    each("cell_types", [&](Section& s) { scene.cell_types.push_back(read_cell_type(s, scene.cell_types)); });
    each("cells", [&](Section& s) { scene.cells.push_back(read_cell(s, scene.cell_types, placed)); });
    each("populations", [&](Section& s) { scene.populations.push_back(read_population(s, scene.cell_types)); });
    each("bodies", [&](Section& s) { scene.bodies.push_back(read_body(s)); });
    const bool coupled = scene.fluid && scene.has_cells();
    if (root_.contains("coupling") || coupled) scene.coupling = one<CouplingSettings>("coupling", read_coupling);
    if (root_.contains("contact")) scene.contact = one<ContactSettings>("contact", read_contact);
    if (root_.contains("blood")) scene.blood = one<BloodSettings>("blood", read_blood);
    if (root_.contains("stretching")) scene.stretching = one<StretchingSettings>("stretching", read_stretching);
    check_modules(scene, [&](const auto& s, const auto& k, const auto& p) { complain(s, k, p); });
    if (scene.coupling && scene.coupling->scheme == CouplingSettings::Scheme::force) {
      note_without_effect(scene);
      drop_volume_modulus(scene);
      note_without_contact(scene);
    }
    note_unused_types(scene);
    for (auto& text : unusual_values(scene)) scene.remarks.push_back(std::move(text));
    read_time_section(scene);
    check_sampling(scene, [&](const auto& s, const auto& k, const auto& p) { complain(s, k, p); });
    const bool has_fluid = scene.fluid.has_value(), has_surfaces = scene.has_cells() || !scene.bodies.empty();
    scene.output = one<OutputSettings>("output", [&](Section& s) { return read_output(s, has_fluid, has_surfaces); });
    check_output(scene, [&](const auto& s, const auto& k, const auto& p) { complain(s, k, p); });
    note_often_history(scene);
    note_no_samples(scene);
    note_often_samples(scene);
    note_sharp_aggregation(scene);
    scene.resolved = echo_;
    return scene;
  }

 private:
  void parse(const CaseFile& file) {
    try {
      root_ = toml::parse(file.text, file.path);
    } catch (const toml::parse_error& error) {
      const auto& at = error.source().begin;
      throw InputError(fmt::format("{}:{}: not valid TOML at column {}: {}", file.path, at.line, at.column, error.description()));
    }
  }

  void check_section_names() const {
    std::vector<std::string> names{"title"};
    for (const auto& section : section_names) names.emplace_back(section.name);
    for (const auto& [key, node] : root_) {
      const std::string name(key.str());
      if (name == "title") continue;
      const bool table = node.is_table() || node.is_array_of_tables();
      const auto at = fmt::format("{}:{}: {}", source_.file, node.source().begin.line, name);
      const auto known =
          std::find_if(std::begin(section_names), std::end(section_names), [&](const SectionName& s) { return s.name == name; });
      if (known == std::end(section_names)) {
        const auto like = nearest(name, names);
        throw InputError(
            fmt::format("{}{}: unknown {}; {}", at, table ? "" : " = " + toml_text(node), table ? "section" : "key outside any section",
                        like.empty() ? fmt::format("known: {}", fmt::join(names, ", ")) : fmt::format("did you mean '{}'?", like)));
      }
      if (known->listed && !node.is_array_of_tables()) throw InputError(fmt::format("{}: write it as a list entry, [[{}]]", at, name));
      if (!known->listed && !node.is_table()) throw InputError(fmt::format("{}: write it as one section, [{}]", at, name));
    }
  }

  void read_title(Case& scene) {
    if (const auto* title = root_.get("title")) {
      if (!title->is_string())
        throw InputError(
            fmt::format("{}:{}: title = {}: must be a text in quotes", source_.file, title->source().begin.line, toml_text(*title)));
      scene.title = *title->value<std::string>();
    }
    echo_ += "title = " + toml_text(scene.title) + "\n";
  }

  void read_time_section(Case& scene) {
    if (scene.stretching) {
      if (root_.contains("time"))
        complain("time", "", "a stretching test goes from rest to rest and has no [time]: leave this section out");
      return;
    }
    if (!root_.contains("time")) throw InputError(source_.file + ": section [time] is missing; it needs step_us and end_us");
    scene.time = one<TimeSettings>("time", [&](Section& s) { return read_time(s, follows_late(scene)); });
    note_time_without_effect(scene);
  }

  /// What resists in a step is what the fluid did in the last one: of a load that comes at once some would be left to the fluid alone.
  static bool follows_late(const Case& scene) {
    if (!scene.coupling || scene.coupling->scheme != CouplingSettings::Scheme::force) return false;
    constexpr double little = 2e-8;  // N s/m: about what the fluid around a cell resists
    const auto viscous = [](const CellSettings& cell) { return cell.membrane_viscosity_N_s_per_m > little; };
    return std::any_of(scene.cells.begin(), scene.cells.end(), viscous) ||
           std::any_of(scene.populations.begin(), scene.populations.end(),
                       [&](const PopulationSettings& p) { return viscous(scene.cell_types[p.type].cell); });
  }

  bool given(const std::string& section, const std::string& key) const {
    const auto* node = root_.get(section);
    return node && node->is_table() && node->as_table()->contains(key);
  }

  /// Keys that are given and mean nothing in this scene: not refused, a case that is changed a little keeps them.
  void note_time_without_effect(Case& scene) const {
    const auto note = [&](bool so, const std::string& text) {
      if (so) scene.remarks.push_back(text);
    };
    const TimeSettings& time = scene.time;
    note(time.first_step_us > time.step_us * (1 + 1e-9),
         fmt::format("time.first_step_us = {:g} is longer than time.step_us = {:g} and has no effect: no step is longer than that",
                     time.first_step_us, time.step_us));
    const bool outflow = std::any_of(scene.boundaries.begin(), scene.boundaries.end(),
                                     [](const BoundarySettings& b) { return b.type == BoundarySettings::Type::outflow; });
    note(given("time", "stop_before_outflow_um") && !outflow,
         fmt::format("time.stop_before_outflow_um = {:g} has no effect: no side is an \"outflow\"", time.stop_before_outflow_um));
    if (!outflow) scene.without_effect.push_back("stop_before_outflow_um");
    note(follows_late(scene) && given("time", "first_step_us") && time.first_step_us == 0,
         "time.first_step_us = 0: with membrane viscosity in a fluid that is everywhere the first steps follow a load late, and "
         "what they leave lasts: leave the key out, for short ones, or reduce time.step_us");
  }

  static void note_sharp_aggregation(Case& scene) {
    if (!scene.coupling || scene.coupling->pressure != CouplingSettings::Pressure::sharp) return;
    if (!scene.contact || !(scene.contact->aggregation_energy > 0)) return;
    scene.remarks.push_back(
        "coupling.pressure = \"sharp\" with contact.aggregation_energy_fJ_per_um2: a sharp pressure takes normal loads as means over "
        "neighbouring vertices, and aggregation acts on few; of its work a fifth (two cells) to four fifths (a pack that starts pressed) "
        "is not "
        "accounted for, whatever the step: use coupling.pressure = \"spread\"");
  }

  static void note_often_history(Case& scene) {
    const double every = scene.output.history_every_us;
    const double shortest = scene.time.first_step_us > 0 ? std::min(scene.time.first_step_us, scene.time.step_us) : scene.time.step_us;
    if (scene.stretching || every == 0 || every >= 0.5 * shortest) return;
    scene.remarks.push_back(
        fmt::format("output.history_every_us = {:g} is less than the shortest step, {:g} us: each step is a line, "
                    "as with 0",
                    every, shortest));
  }

  static void note_often_samples(Case& scene) {
    if (!scene.blood || scene.blood->sample_every_us == 0 || scene.blood->sample_every_us >= scene.time.step_us) return;
    scene.remarks.push_back(fmt::format("blood.sample_every_us = {:g} is less than time.step_us: samples are {:g} us apart",
                                        scene.blood->sample_every_us, scene.blood->interval_us(scene.time.step_us)));
  }

  static void note_no_samples(Case& scene) {
    if (!scene.blood || is_sampled(scene)) return;
    scene.remarks.push_back(
        fmt::format("blood.sample_every_us: unless it is set, samples are ten steps apart, {:g} us, and none of them falls between "
                    "blood.from_us = {:g} us and time.end_us = {:g} us: nothing of blood will be told",
                    scene.blood->interval_us(scene.time.step_us), scene.blood->from_us, scene.time.end_us));
  }

  /// Types that no cell is of.
  void note_unused_types(Case& scene) const {
    std::vector<std::string> unused;
    for (std::size_t t = 0; t < scene.cell_types.size(); ++t) {
      const auto of_it = [&](const auto& cell) { return cell.type == static_cast<int>(t); };
      if (std::none_of(scene.cells.begin(), scene.cells.end(), of_it) &&
          std::none_of(scene.populations.begin(), scene.populations.end(), of_it))
        unused.push_back(fmt::format("cell_types.{} (\"{}\")", t, scene.cell_types[t].name));
    }
    if (!unused.empty())
      scene.remarks.push_back(
          fmt::format("no cell is of {}: {} no effect", fmt::join(unused, ", "), unused.size() == 1 ? "it has" : "they have"));
  }

  /// Keys of cells that membranes as forces have no use for: refused, they would have to be taken out of a case to try it with
  /// this coupling.
  void note_without_effect(Case& scene) const {
    for (const auto& [key, why] : {std::pair{"mass_pg", "membranes have no mass of their own"},
                                   {"volume_modulus_Pa", "the fluid inside keeps each cell's volume as it is"},
                                   {"interior", "the fluid is inside the cells as well (viscosity_ratio)"}}) {
      scene.without_effect.emplace_back(key);
      std::string first;
      int others = -1;
      for (const char* list : {"cell_types", "cells"}) {
        const auto* entries = root_.contains(list) ? root_.get(list)->as_array() : nullptr;
        for (std::size_t n = 0; entries && n < entries->size(); ++n) {
          const auto* found = entries->get(n)->as_table()->get(key);
          if (found && ++others == 0) first = fmt::format("{}.{}.{} = {}", list, n, key, toml_text(*found));
        }
      }
      if (others < 0) continue;
      scene.remarks.push_back(fmt::format("{}{} has no effect with coupling.scheme = \"force\": {}", first,
                                          others > 0 ? fmt::format(" (and {} more)", others) : "", why));
    }
  }

  /// A modulus that has nothing to hold would still limit the step.
  static void drop_volume_modulus(Case& scene) {
    for (CellTypeSettings& type : scene.cell_types) type.cell.volume_modulus_Pa = 0;
    for (CellSettings& cell : scene.cells) cell.volume_modulus_Pa = 0;
  }

  static void note_without_contact(Case& scene) {
    if (scene.contact || (scene.cells.size() < 2 && scene.populations.empty())) return;
    const std::string number = scene.populations.empty() ? std::to_string(scene.cells.size()) : "many";
    scene.remarks.push_back(
        fmt::format("there are {} cells and no [contact]: nothing but the fluid keeps them apart, and that they cross would not be "
                    "seen; add [contact]",
                    number));
  }

  template <class Settings, class Read>
  Settings one(const std::string& name, const Read& read) {
    const auto* node = root_.get(name);
    Section section(source_, name, node ? node->as_table() : nullptr);
    auto settings = read(section);
    echo_ += fmt::format("\n[{}]\n{}", name, section.echo());
    return settings;
  }

  template <class Read>
  void each(const std::string& name, const Read& read) {
    const auto* node = root_.get(name);
    if (!node) return;
    int number = 0;
    for (const auto& entry : *node->as_array()) {
      Section section(source_, fmt::format("{}.{}", name, number++), entry.as_table());
      read(section);
      echo_ += fmt::format("\n[[{}]]\n{}", name, section.echo());
    }
  }

  // Path of a section as in messages, "cells.1", to its table; the first entry stands for a whole list.
  [[noreturn]] void complain(const std::string& path, const std::string& key, const std::string& problem) const {
    const auto dot = path.find('.');
    const auto* node = root_.get(path.substr(0, dot));
    if (node && node->is_array()) node = node->as_array()->get(dot == std::string::npos ? 0 : std::stoul(path.substr(dot + 1)));
    Section(source_, path, node ? node->as_table() : nullptr).fail(key, problem);
  }

  CaseSource source_;
  toml::table root_;
  std::string echo_;
};

}  // namespace

CaseFile load_case_file(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) throw InputError(path + ": is a folder, not a case file");
  std::ifstream in(path, std::ios::binary);
  CaseFile file{path, {std::istreambuf_iterator<char>(in), {}}};
  if (!in.is_open() || in.bad()) throw InputError(path + ": cannot read the case file (it does not exist, or reading it is not permitted)");
  return file;
}

Case read_case(const CaseFile& file, const std::vector<std::string>& overrides) { return CaseReader(file, overrides).read(); }

std::string resolved_text(const Case& scene) {
  std::string text;
  std::istringstream lines(scene.resolved);
  for (std::string line; std::getline(lines, line);) {
    const auto& idle = scene.without_effect;
    const bool drop = std::find(idle.begin(), idle.end(), line.substr(0, line.find(" = "))) != idle.end();
    if (!drop) text += line + "\n";
  }
  return text;
}

Case read_case(const std::string& path, const std::vector<std::string>& overrides) { return read_case(load_case_file(path), overrides); }

}  // namespace corpuscle
