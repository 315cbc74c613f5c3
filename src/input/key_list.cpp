#include "input/key_list.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <set>

#include "core/error.hpp"
#include "core/nearest.hpp"
#include "input/overrides.hpp"
#include "input/sections.hpp"

namespace corpuscle {
namespace {

using Read = std::function<void(Section&)>;
using Reasons = std::map<std::string, std::set<std::string>>;  // key to why it has no meaning somewhere

KeyRecorder recorded(const std::string& name, const Read& read, const std::map<std::string, std::size_t>& chosen) {
  const CaseSource nowhere;
  Section section(nowhere, name, nullptr);
  KeyRecorder recorder;
  recorder.chosen = chosen;
  section.record_into(recorder);
  try {
    read(section);
  } catch (const RecordingEnds&) {  // a combination that is refused: what was read until then counts
  }
  return recorder;
}

/// Adds the keys of one run, each after the one before it, and the reasons why others have no meaning.
void merge(const KeyRecorder& run, std::vector<KeyRecord>& keys, Reasons& why) {
  std::size_t place = 0;
  for (const auto& key : run.keys) {
    const auto known = std::find_if(keys.begin(), keys.end(), [&](const auto& k) { return k.key == key.key; });
    if (known == keys.end()) {
      keys.insert(keys.begin() + static_cast<long>(place), key);
      ++place;
    } else {
      place = static_cast<std::size_t>(known - keys.begin()) + 1;
    }
  }
  for (const auto& [key, reason] : run.unused) why[key].insert(reason);
}

std::vector<KeyRecord> keys_of(const std::string& name, const Read& read) {
  std::vector<KeyRecord> keys;
  Reasons why;
  std::vector<std::map<std::string, std::size_t>> waiting{{}};
  while (!waiting.empty()) {
    const auto chosen = waiting.back();
    waiting.pop_back();
    const KeyRecorder run = recorded(name, read, chosen);
    merge(run, keys, why);
    for (const auto& [key, words] : run.choices) {
      if (chosen.count(key)) continue;
      for (std::size_t word = words.size(); word-- > 0;) {
        auto next = chosen;
        next[key] = word;
        waiting.push_back(next);
      }
      break;  // the others are asked for again then
    }
  }
  for (auto& key : keys)
    if (const auto found = why.find(key.key); found != why.end()) key.only = fmt::format("{}", fmt::join(found->second, "; "));
  return keys;
}

Read reader_of(const std::string& name) {
  if (name == "time") return [](Section& s) { read_time(s); };
  if (name == "grid") return read_grid;
  if (name == "fluid") return read_fluid;
  if (name == "boundary") return read_boundary;
  if (name == "cell_types") return [](Section& s) { read_cell_type(s, {}); };
  if (name == "cells")
    return [](Section& s) {
      s.describe({"type", "The type of the cell, in place of keys of its own."},
                 "the name of one of [[cell_types]], which then has the keys that all its cells share", "");
      read_cell(s, {}, true);
    };
  if (name == "populations") return [](Section& s) { read_population(s, {}); };
  if (name == "bodies") return read_body;
  if (name == "coupling") return read_coupling;
  if (name == "contact") return read_contact;
  if (name == "blood") return read_blood;
  if (name == "stretching") return read_stretching;
  if (name == "output") return [](Section& s) { read_output(s, true, true); };
  return {};
}

}  // namespace

std::vector<SectionRecord> list_keys() {
  std::vector<SectionRecord> sections;
  for (const auto& [name, listed] : section_names)
    if (const Read read = reader_of(name)) sections.push_back({name, listed, keys_of(name, read)});
  return sections;
}

std::string unit_of(const std::string& key) {
  // Longer ends before those that they end in.
  static const std::pair<std::string, std::string> units[] = {{"_pg_per_um2_per_us", "pg/(um2 us)"},
                                                              {"_um2_per_us", "um2/us"},
                                                              {"_pg_per_um3", "pg/um3"},
                                                              {"_Pa_per_um", "Pa/um"},
                                                              {"_fJ_per_um2", "fJ/um2"},
                                                              {"_N_s_per_m", "N s/m"},
                                                              {"_rad_per_s", "rad/s"},
                                                              {"_mm_per_s", "mm/s"},
                                                              {"_uN_per_m", "uN/m"},
                                                              {"_deg", "deg"},
                                                              {"_um", "um"},
                                                              {"_us", "us"},
                                                              {"_pg", "pg"},
                                                              {"_nN", "nN"},
                                                              {"_pN", "pN"},
                                                              {"_Pa", "Pa"},
                                                              {"_J", "J"}};
  for (const auto& [end, unit] : units)
    if (key.size() > end.size() && key.compare(key.size() - end.size(), end.size(), end) == 0) return unit;
  return "";
}

namespace {

std::string heading(const SectionRecord& section) { return section.listed ? "[[" + section.name + "]]" : "[" + section.name + "]"; }

std::string default_text(const KeyRecord& key) {
  return !key.value.empty() ? "default " + key.value : key.optional ? "may be left out" : "required";
}

}  // namespace

std::string keys_text(const std::string& section) {
  std::string text;
  std::vector<std::string> names;
  if (section.empty()) text = "title: What the case is called in reports.\n    a text in quotes; may be left out\n";
  for (const auto& s : list_keys()) {
    names.push_back(s.name);
    if (!section.empty() && section != s.name) continue;
    text += fmt::format("\n{}{}\n", heading(s), s.listed ? "   as often as needed" : "");
    for (const auto& key : s.keys)
      text += fmt::format("  {}: {}\n      {}; {}{}\n", key.key, key.what, key.allowed, default_text(key),
                          key.only.empty() ? "" : "; " + key.only);
  }
  if (!section.empty() && std::find(names.begin(), names.end(), section) == names.end()) {
    const auto like = nearest(section, names);
    throw InputError(
        fmt::format("keys {}: no such section; {}", section,
                    like.empty() ? fmt::format("there are {}", fmt::join(names, ", ")) : fmt::format("did you mean '{}'?", like)));
  }
  return text;
}

std::string keys_markdown() {
  std::string text =
      "# Keys of a case file\n\n"
      "Made by `corpuscle keys --markdown` from what the readers ask for; a test holds this page to it. A case file is TOML: sections in "
      "brackets, of which those in double brackets are written as often as needed, and `key = value` lines. Before the first section may "
      "stand "
      "`title`, a text in quotes. `--set section.key=value` overrides a key for one run (`--set cells.0.vertices=1000` for the first of a "
      "list), "
      "`corpuscle check --resolved CASE` prints a case with every default filled in, and every run keeps that in its folder as "
      "`resolved.toml`. "
      "A key that means nothing in a scene is refused or named with a warning, and one that is misspelt with what it is like.\n";
  for (const auto& s : list_keys()) {
    text += fmt::format("\n## `{}`\n\n| key | unit | what it says | allowed | default |\n|---|---|---|---|---|\n", heading(s));
    for (const auto& key : s.keys)
      text += fmt::format("| `{}` | {} | {} | {}{} | {} |\n", key.key, unit_of(key.key), key.what, key.allowed,
                          key.only.empty() ? "" : "; " + key.only, key.value.empty() ? (key.optional ? "none" : "required") : key.value);
  }
  return text;
}

}  // namespace corpuscle
