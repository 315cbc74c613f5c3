// Every section and key of a case file, as the readers themselves know them.
#pragma once

#include <string>
#include <vector>

namespace corpuscle {

/// A key with its default and what is allowed.
struct KeyRecord {
  std::string key, allowed;
  std::string value;     // the default as TOML, "" if the key is required
  bool optional = false; // without a default: may be left out
  std::string only;      // where the key has no meaning: why, as the message there says
};

struct SectionRecord {
  std::string name;   // "boundary"
  bool listed = false;  // written [[name]], as often as needed
  std::vector<KeyRecord> keys;
};

/// Found by letting each reader read an empty section, once for every combination of the words that it lets choose from.
std::vector<SectionRecord> list_keys();

/// For the screen: a line for each key, with its default and what is allowed.
/// @param section  only this one; "" for all
/// @throws InputError  no section has that name
std::string keys_text(const std::string& section);

}  // namespace corpuscle
