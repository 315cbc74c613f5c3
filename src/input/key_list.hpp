// Every section and key of a case file, as the readers themselves know them.
#pragma once

#include <string>
#include <vector>

namespace corpuscle {

/// A key with its default and what is allowed.
struct KeyRecord {
  std::string key, what, allowed;  // the name, what it says, what is allowed
  std::string value;               // the default as TOML, "" if the key is required
  bool optional = false;           // without a default: may be left out
  std::string only;                // where the key has no meaning: why, as the message there says
};

struct SectionRecord {
  std::string name;     // "boundary"
  bool listed = false;  // written [[name]], as often as needed
  std::vector<KeyRecord> keys;
};

/// Found by letting each reader read an empty section, once for every combination of the words that it lets choose from.
std::vector<SectionRecord> list_keys();

/// As the name of a key ends: "um2/us" of "kinematic_viscosity_um2_per_us"; "" for what has none.
std::string unit_of(const std::string& key);

/// For the screen: two lines for each key, with what it says, what is allowed and its default.
/// @param section  only this one; "" for all
/// @throws InputError  no section has that name
std::string keys_text(const std::string& section);

/// All sections as tables for docs/keys.md.
std::string keys_markdown();

}  // namespace corpuscle
