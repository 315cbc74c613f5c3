#include "input/overrides.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "core/error.hpp"
#include "core/nearest.hpp"

namespace corpuscle {
namespace {

[[noreturn]] void refuse(const std::string& text, const std::string& problem) {
  throw InputError(fmt::format("--set {}: {}", text, problem));
}

std::vector<std::string> split(const std::string& path) {
  std::vector<std::string> parts;
  std::istringstream in(path);
  for (std::string part; std::getline(in, part, '.');) parts.push_back(part);
  if (!path.empty() && path.back() == '.') parts.emplace_back();
  return parts;
}

// A TOML value, or a bare word taken as a text.
toml::table parse_value(const std::string& override_text, const std::string& value) {
  if (value.empty()) refuse(override_text, "no value after '='");
  try {
    auto parsed = toml::parse("value = " + value);
    if (parsed.size() == 1) return parsed;
  } catch (const toml::parse_error& error) {
    if (std::string("[{\"'").find(value.front()) != std::string::npos)
      refuse(override_text, fmt::format("the value is not valid TOML: {}", error.description()));
  }
  if (value.find('\n') != std::string::npos) refuse(override_text, "the value must be on one line");
  return toml::table{{"value", value}};
}

toml::table& section_of(toml::table& root, const std::string& text, const std::vector<std::string>& parts) {
  const auto known =
      std::find_if(std::begin(section_names), std::end(section_names), [&](const SectionName& s) { return s.name == parts[0]; });
  if (known == std::end(section_names)) {
    std::vector<std::string> names;
    for (const auto& s : section_names) names.emplace_back(s.name);
    const auto like = nearest(parts[0], names);
    refuse(text, fmt::format("there is no section '{}'; {}", parts[0],
                             like.empty() ? fmt::format("known: {}", fmt::join(names, ", ")) : fmt::format("did you mean '{}'?", like)));
  }
  if (parts.size() != (known->listed ? 3u : 2u))
    refuse(text, known->listed ? fmt::format("[[{0}]] is a list: write {0}.0.key=value for its first entry", parts[0])
                               : fmt::format("write {}.key=value", parts[0]));
  if (!known->listed) {
    if (!root.contains(parts[0])) root.insert(parts[0], toml::table{});
    auto* section = root.get(parts[0])->as_table();
    if (!section) refuse(text, fmt::format("'{0}' in the case file is not a section [{0}]", parts[0]));
    return *section;
  }
  const auto* node = root.get(parts[0]);
  auto* list = node ? root.get(parts[0])->as_array() : nullptr;
  const bool digits = !parts[1].empty() && parts[1].size() < 9 &&
                      std::all_of(parts[1].begin(), parts[1].end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!digits) refuse(text, fmt::format("'{}' is not the number of an entry: write {}.0.{}=value", parts[1], parts[0], parts[2]));
  const std::size_t index = std::stoul(parts[1]);
  const std::size_t size = list ? list->size() : 0;
  auto* entry = index < size ? list->get(index)->as_table() : nullptr;
  if (!entry) refuse(text, fmt::format("the case has {} [[{}]], counted from 0", size, parts[0]));
  return *entry;
}

}  // namespace

std::map<std::string, std::string> apply_overrides(toml::table& root, const std::vector<std::string>& overrides) {
  std::map<std::string, std::string> set;
  for (const auto& text : overrides) {
    const auto equals = text.find('=');
    if (equals == std::string::npos || equals == 0) refuse(text, "write section.key=value, for example time.step_us=0.5");
    const auto path = text.substr(0, equals);
    const auto parts = split(path);
    if (std::any_of(parts.begin(), parts.end(), [](const std::string& part) { return part.empty(); }))
      refuse(text, "write section.key=value, for example time.step_us=0.5");
    auto value = parse_value(text, text.substr(equals + 1));
    auto& section = path == "title" ? root : section_of(root, text, parts);
    value.get("value")->visit([&](auto& node) { section.insert_or_assign(parts.back(), std::move(node)); });
    set[path] = text;
  }
  return set;
}

}  // namespace corpuscle
