#include "input/case_changes.hpp"

#include <algorithm>
#include <map>
#include <sstream>
#include <utility>

namespace corpuscle {
namespace {

using Values = std::vector<std::pair<std::string, std::string>>;  // key to value, in the order of the case

/// The echo of a case has one key a line, below "[section]" or "[[list]]".
Values values_of(const std::string& resolved) {
  Values values;
  std::map<std::string, int> entries;  // of each list so far
  std::string section;
  std::istringstream lines(resolved);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) continue;
    if (line[0] == '[') {
      const bool listed = line[1] == '[';
      section = line.substr(listed ? 2 : 1, line.find(']') - (listed ? 2 : 1));
      if (!listed) continue;
      const int number = entries[section]++;
      section.append(1, '.').append(std::to_string(number));
      continue;
    }
    const auto cut = line.find(" = ");
    if (cut == std::string::npos) continue;
    values.emplace_back((section.empty() ? "" : section + ".") + line.substr(0, cut), line.substr(cut + 3));
  }
  for (const char* list : {"boundary", "cells", "populations", "bodies"})
    values.emplace_back(std::string("number of [[") + list + "]]", std::to_string(entries[list]));
  return values;
}

bool starts_with(const std::string& text, const char* start) { return text.rfind(start, 0) == 0; }

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// Keys of a run that change nothing in what it computes.
bool only_of_the_run(const std::string& key) {
  return key == "title" || starts_with(key, "output.") || starts_with(key, "blood.") || key == "time.end_us" ||
         key == "time.stop_before_outflow_um";
}

bool is_geometry(const std::string& key) {
  if (starts_with(key, "number of") || starts_with(key, "grid.")) return true;
  if (starts_with(key, "populations.")) return true;  // packed anew they would be other cells
  if (starts_with(key, "bodies.")) return true;       // moved as prescribed from the start: another velocity is another place
  if (starts_with(key, "boundary.")) return ends_with(key, ".side") || ends_with(key, ".type");
  if (!starts_with(key, "cells.") && !starts_with(key, "cell_types.")) return false;
  for (const char* name : {".type", ".vertices", ".shape", ".diameter_um", ".radius_um", ".semi_axes_um", ".mesh", ".interior", ".scale",
                           ".recenter", ".align", ".center_um", ".axis", ".spin_deg", ".start_stretch"})
    if (ends_with(key, name)) return true;
  return false;
}

/// A file under another path: what is in it counts, see file_changes().
bool other_path(const std::string& key, const std::string& before, const std::string& now) {
  const auto named = [](const std::string& value) { return value.size() > 2 && value.front() == '"'; };
  return (ends_with(key, ".mesh") || ends_with(key, ".file")) && named(before) && named(now);
}

}  // namespace

std::vector<CaseChange> case_changes(const std::string& before, const std::string& now) {
  const Values old_values = values_of(before), new_values = values_of(now);
  const std::string absent = "absent";
  std::vector<CaseChange> changes;
  const auto note = [&](const std::string& key, const std::string& old_value, const std::string& new_value) {
    if (old_value == new_value || only_of_the_run(key) || other_path(key, old_value, new_value)) return;
    // Membranes as forces have fluid inside, others have none.
    const bool other_fluid = key == "coupling.scheme" && (old_value == "\"force\"" || new_value == "\"force\"");
    changes.push_back({key, old_value, new_value, is_geometry(key) || other_fluid});
  };
  const auto find = [](const Values& values, const std::string& key) {
    return std::find_if(values.begin(), values.end(), [&](const auto& value) { return value.first == key; });
  };
  for (const auto& [key, value] : new_values) {
    const auto old = find(old_values, key);
    if (old != old_values.end())
      note(key, old->second, value);
    else
      note(key, absent, value);
  }
  for (const auto& [key, value] : old_values)
    if (find(new_values, key) == new_values.end()) note(key, value, absent);
  return changes;
}

std::vector<CaseChange> file_changes(const std::string& before, const std::string& now) {
  const Values old_values = values_of(before);
  std::vector<CaseChange> changes;
  const auto path = [](const std::string& value) { return value.substr(value.find(' ') + 1); };
  for (const auto& [key, value] : values_of(now))
    for (const auto& [old_key, old_value] : old_values)
      if (old_key == key && old_value.substr(0, old_value.find(' ')) != value.substr(0, value.find(' ')))
        changes.push_back({key, path(old_value) + " with other content", path(value), true});
  return changes;
}

}  // namespace corpuscle
