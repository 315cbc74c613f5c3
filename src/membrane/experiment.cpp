#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>

#include "core/error.hpp"
#include "membrane/stretching.hpp"

namespace corpuscle {

namespace {

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');) {
    const auto first = field.find_first_not_of(" \t\r"), last = field.find_last_not_of(" \t\r");
    fields.push_back(first == std::string::npos ? "" : field.substr(first, last - first + 1));
  }
  return fields;
}

double number(const std::string& path, int line, const std::string& column, const std::string& text) {
  std::istringstream in(text);
  double value;
  if (!(in >> value) || !in.eof()) {
    throw InputError(fmt::format("{}, line {}: {} = '{}' is not a number", path, line, column, text));
  }
  return value;
}

}  // namespace

std::vector<ExperimentPoint> read_experiment(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw InputError(fmt::format("experiment file {}: cannot be opened; check stretching.experiment", path));
  const std::vector<std::string> wanted = {"force_pN",         "transverse_um", "axial_um",   "transverse_lo_um",
                                           "transverse_hi_um", "axial_lo_um",   "axial_hi_um"};
  std::vector<std::string> names;
  std::vector<ExperimentPoint> points;
  int number_of_line = 0;
  for (std::string line; std::getline(file, line);) {
    ++number_of_line;
    const auto fields = split(line);
    if (fields.empty() || (fields.size() == 1 && fields[0].empty()) || line[0] == '#') continue;
    if (names.empty()) {
      names = fields;
      continue;
    }
    if (fields.size() != names.size()) {
      throw InputError(fmt::format("{}, line {}: {} values under {} columns", path, number_of_line, fields.size(), names.size()));
    }
    std::map<std::string, double> row;
    for (std::size_t k = 0; k < names.size(); ++k) row[names[k]] = number(path, number_of_line, names[k], fields[k]);
    for (const auto& name : wanted) {
      if (!row.count(name)) throw InputError(fmt::format("{}: there is no column {}", path, name));
    }
    points.push_back({row["force_pN"], row["transverse_um"], row["axial_um"], row["transverse_lo_um"], row["transverse_hi_um"],
                      row["axial_lo_um"], row["axial_hi_um"]});
  }
  if (points.empty()) throw InputError(fmt::format("experiment file {}: holds no measurement", path));
  return points;
}

namespace {

/// An eighth of the second difference is how far a parabola through three points lies from the chords between neighbours; of
/// two points alone, nothing is known but that the curve lies between them.
double interpolation_error(const std::vector<StretchingStep>& steps) {
  double most = 0;
  for (double StretchingStep::*diameter : {&StretchingStep::axial_um, &StretchingStep::transverse_um}) {
    if (steps.size() == 2) most = std::max(most, 0.5 * std::abs(steps[1].*diameter - steps[0].*diameter));
    for (std::size_t n = 2; n < steps.size(); ++n)
      most = std::max(most, std::abs(steps[n].*diameter - 2 * steps[n - 1].*diameter + steps[n - 2].*diameter) / 8);
  }
  return most;
}

}  // namespace

ExperimentComparison compare(const StretchingResult& result, const std::vector<ExperimentPoint>& experiment) {
  ExperimentComparison c;
  const auto& steps = result.steps;
  c.interpolation_um = interpolation_error(steps);
  for (const ExperimentPoint& p : experiment) {
    if (p.force_pN < steps.front().force_pN || p.force_pN > steps.back().force_pN) continue;
    const auto upper = std::find_if(steps.begin() + 1, steps.end() - 1, [&](const StretchingStep& s) { return s.force_pN >= p.force_pN; });
    const auto lower = upper - 1;
    const double w = (p.force_pN - lower->force_pN) / (upper->force_pN - lower->force_pN);
    const double axial = (1 - w) * lower->axial_um + w * upper->axial_um;
    const double transverse = (1 - w) * lower->transverse_um + w * upper->transverse_um;
    ++c.points;
    c.rms_axial_um += (axial - p.axial_um) * (axial - p.axial_um);
    c.rms_transverse_um += (transverse - p.transverse_um) * (transverse - p.transverse_um);
    c.inside_both +=
        axial >= p.axial_lo_um && axial <= p.axial_hi_um && transverse >= p.transverse_lo_um && transverse <= p.transverse_hi_um;
  }
  if (c.points > 0) {
    c.rms_axial_um = std::sqrt(c.rms_axial_um / c.points);
    c.rms_transverse_um = std::sqrt(c.rms_transverse_um / c.points);
  }
  return c;
}

}  // namespace corpuscle
