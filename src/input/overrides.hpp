// "--set section.key=value" on top of a parsed case file.
#pragma once

#include <toml++/toml.h>

#include <map>
#include <string>
#include <vector>

namespace corpuscle {

/// Sections a case file may have; `listed` ones are written [[name]] and addressed as name.0, name.1, ...
struct SectionName {
  const char* name;
  bool listed;
};
inline constexpr SectionName section_names[] = {
    {"time", false},  {"grid", false},       {"fluid", false},  {"boundary", true}, {"cell_types", true},
    {"cells", true},  {"populations", true}, {"bodies", true},  {"contact", false}, {"coupling", false},
    {"blood", false}, {"stretching", false}, {"output", false},
};

/// Put every override into the table. A section that the file lacks is added; an entry of a list must exist.
/// @return key path to the text of the override that set it
/// @throws InputError  an override that is malformed or addresses nothing
std::map<std::string, std::string> apply_overrides(toml::table& root, const std::vector<std::string>& overrides);

}  // namespace corpuscle
