// The list of keys is what the readers ask for.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "core/error.hpp"
#include "input/case_file.hpp"
#include "input/key_list.hpp"

using namespace corpuscle;
using Catch::Contains;

namespace {

const KeyRecord* find(const std::string& section, const std::string& key) {
  static const auto all = list_keys();
  for (const auto& s : all)
    for (const auto& k : s.keys)
      if (s.name == section && k.key == key) return &k;
  return nullptr;
}

}  // namespace

TEST_CASE("every key that a case is echoed with is listed") {
  int looked = 0;
  for (const auto& entry : std::filesystem::directory_iterator(CORPUSCLE_SOURCE_DIR "/cases")) {
    if (entry.path().extension() != ".toml") continue;
    std::istringstream lines(read_case(entry.path().string()).resolved);
    std::string section;
    for (std::string line; std::getline(lines, line);) {
      if (line.empty()) continue;
      if (line[0] == '[') {
        section = line.substr(line.find_first_not_of('['), line.find(']') - line.find_first_not_of('['));
        continue;
      }
      if (section.empty()) continue;
      INFO(entry.path() << ": " << section << ": " << line);
      CHECK(find(section, line.substr(0, line.find(" = "))));
      ++looked;
    }
  }
  CHECK(looked > 100);
}

TEST_CASE("every key says what it is for in one sentence") {
  for (const auto& section : list_keys())
    for (const auto& key : section.keys) {
      INFO(section.name << "." << key.key << ": " << key.what);
      REQUIRE(key.what.size() > 10);
      CHECK(key.what.back() == '.');
      CHECK(key.what.find(". ") == std::string::npos);
      CHECK((std::isupper(static_cast<unsigned char>(key.what[0])) != 0));
    }
}

TEST_CASE("the unit of a key is in its name") {
  CHECK(unit_of("kinematic_viscosity_um2_per_us") == "um2/us");
  CHECK(unit_of("robin_coefficient_pg_per_um2_per_us") == "pg/(um2 us)");
  CHECK(unit_of("membrane_viscosity_N_s_per_m") == "N s/m");
  CHECK(unit_of("bending_modulus_J") == "J");
  CHECK(unit_of("end_us") == "us");
  CHECK(unit_of("pressure_gradient_Pa_per_um") == "Pa/um");
  for (const char* key : {"nodes", "um", "axis", "scheme", "bonus"}) CHECK(unit_of(key).empty());
}

TEST_CASE("the page of keys is what the program prints") {
  std::ifstream file(CORPUSCLE_SOURCE_DIR "/docs/keys.md");
  const std::string page{std::istreambuf_iterator<char>(file), {}};
  INFO("build/openmp/corpuscle keys --markdown > docs/keys.md makes it anew");
  CHECK(page == keys_markdown());
}

TEST_CASE("keys are listed with default, range and where they belong") {
  CHECK(find("time", "step_us")->value.empty());
  CHECK_FALSE(find("time", "step_us")->optional);
  CHECK_THAT(find("time", "step_us")->allowed, Contains("above 0"));
  CHECK(find("fluid", "density_pg_per_um3")->value == "1");
  CHECK(find("cells", "vertices")->allowed == "a whole number from 200 to 30000");
  CHECK(find("cells", "vertices")->value == "500");
  // Behind choices, of a word or of a file that is given.
  CHECK_THAT(find("grid", "helix_pitch_um")->only, Contains("helix"));
  CHECK_THAT(find("grid", "diameter_um")->only, Contains("straight_tube"));
  CHECK_THAT(find("cells", "scale")->only, Contains("mesh file"));
  CHECK_THAT(find("boundary", "radial_table")->only, Contains("table"));
  CHECK_THAT(find("coupling", "tolerance")->only, Contains("iterated"));
  CHECK_THAT(find("coupling", "kernel")->only, Contains("force"));
  CHECK_THAT(find("coupling", "robin_coefficient_pg_per_um2_per_us")->only, Contains("force"));
  CHECK(find("boundary", "side")->only.empty());
  for (const auto& [section, key] : {std::pair{"fluid", "convection"},
                                     {"output", "fields"},
                                     {"boundary", "velocity_mm_per_s"},
                                     {"coupling", "robin_coefficient_pg_per_um2_per_us"},
                                     {"stretching", "experiment"},
                                     {"blood", "from_us"},
                                     {"blood", "bins"},
                                     {"output", "cells_in_history"},
                                     {"bodies", "semi_axes_um"}})
    CHECK(find(section, key));
  CHECK_THAT(keys_text("grid"),
             Contains("[grid]") && Contains("length_um: Length of the tube") && Contains("a number above 0") && !Contains("[fluid]"));
  CHECK_THAT(keys_text(""), Contains("[[cells]]") && Contains("title"));
  CHECK_THROWS_WITH(keys_text("gird"), Contains("did you mean 'grid'?"));
}
