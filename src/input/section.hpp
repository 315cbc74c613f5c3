// One section of a case file: reads each key with its type and range, remembers which keys exist, and echoes the
// values.
#pragma once

#include <toml++/toml.h>

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "input/case.hpp"
#include "input/key_list.hpp"

namespace corpuscle {

/// Where the values came from: the file, and the overrides by the key they replace ("time.step_us").
struct CaseSource {
  std::string file;
  std::string folder;                            // that relative paths in the file start from
  std::map<std::string, std::string> overrides;  // key to the text of its --set
};

/// Allowed range of a number.
struct Bounds {
  double low, high;
  bool low_excluded = false;
  std::string text;

  bool contains(double value) const { return (low_excluded ? value > low : value >= low) && value <= high; }
};
Bounds positive(double high = 1e300);
Bounds not_negative(double high = 1e300);
Bounds between(double low, double high);

/// A key and, in one sentence, what it says.
struct Key {
  std::string name, what;
};

/// What a reader asks of a section, gathered while it reads an empty one.
struct KeyRecorder {
  std::map<std::string, std::size_t> chosen;                // which word the reader is to find for each choice
  std::map<std::string, std::vector<std::string>> choices;  // those it has asked for, with their words
  std::vector<KeyRecord> keys;
  std::map<std::string, std::string> unused;  // keys without meaning in this run, and why
};
/// Thrown where a reader refuses the values that it was given by a recorder.
struct RecordingEnds {};

class Section {
 public:
  /// @param path   as used in messages and by --set: "time", "cells.0"
  /// @param table  null: the section is absent and every value is its default
  Section(const CaseSource& source, std::string path, const toml::table* table);

  /// From now on every key is recorded, and nothing is refused or missed.
  void record_into(KeyRecorder& recorder) { recorder_ = &recorder; }
  bool recording() const { return recorder_ != nullptr; }
  /// Of a key that is read by other means than those below.
  /// @param value  default as TOML; "" for a key that may be left out
  void describe(const Key& key, const std::string& allowed, const std::string& value) { record(key, allowed, value, true); }

  bool has(const std::string& key) const { return table_ && table_->contains(key); }
  const toml::node* node(const std::string& key);

  /// A value in range, or `fallback`; without a fallback the key is required (reported by finish()).
  double number(const Key& key, const Bounds& allowed, std::optional<double> fallback = {});
  int integer(const Key& key, int low, int high, std::optional<int> fallback = {});
  bool flag(const Key& key, bool fallback);
  std::string text(const Key& key, std::optional<std::string> fallback = {});
  Triple triple(const Key& key, const Bounds& allowed, std::optional<Triple> fallback = {});
  std::array<int, 3> integers(const Key& key, int low, int high);
  /// Rows of N numbers, at least `min_rows` of them; absent: empty.
  template <std::size_t N>
  std::vector<std::array<double, N>> rows(const Key& key, std::size_t min_rows);
  /// Path of an existing file, made absolute; relative paths start at the case file's folder. Absent: "".
  std::string file(const Key& key, bool required);

  /// One of several words. Without a fallback a missing key is reported at once, since it decides which others exist.
  template <class E>
  E choice(const Key& key, const std::vector<std::pair<std::string, E>>& words, std::optional<E> fallback = {}) {
    std::vector<std::string> names;
    names.reserve(words.size());
    for (const auto& [name, value] : words) names.push_back(name);
    std::size_t chosen = words.size();
    for (std::size_t i = 0; fallback && i < words.size(); ++i)
      if (words[i].second == *fallback) chosen = i;
    return words[word(key, names, chosen)].second;
  }

  /// The key has no meaning here: an error if it is present.
  void unused(const std::string& key, const std::string& why);
  /// Required after all, as found from other values.
  void require(const Key& key, const std::string& allowed);
  /// Unknown keys first (they explain missing ones), then missing keys.
  void finish();

  /// Line of the echo that stands for a value read by other means.
  void echo_line(const std::string& key, const std::string& value) { echo_.emplace_back(key, value); }
  /// Every key with the value used, as TOML lines.
  std::string echo() const;

  [[noreturn]] void fail(const std::string& key, const std::string& problem) const;
  const std::string& path() const { return path_; }
  const CaseSource& source() const { return source_; }
  /// The keys that were asked for, whether present or not.
  const std::vector<std::string>& known() const { return known_; }
  /// The keys that are present.
  std::vector<std::string> present() const;

 private:
  void record(const Key& key, const std::string& allowed, const std::string& value, bool optional);
  std::size_t word(const Key& key, const std::vector<std::string>& names, std::size_t fallback);
  double number_in(const std::string& key, const toml::node& node, const Bounds& allowed) const;
  std::vector<double> numbers_in(const std::string& key, const toml::node& node, std::size_t count, const std::string& allowed) const;
  std::string where(const std::string& key) const;
  void know(const std::string& key);
  void miss(const std::string& key, const std::string& allowed) { missing_.emplace_back(key, allowed); }

  const CaseSource& source_;
  std::string path_;
  const toml::table* table_;
  KeyRecorder* recorder_ = nullptr;
  std::vector<std::string> known_;
  std::vector<std::pair<std::string, std::string>> missing_;  // key, what it should be
  std::vector<std::pair<std::string, std::string>> echo_;
};

/// TOML text of a value; that of a node is for messages, and shortened.
std::string toml_text(const std::string& text);
std::string toml_text(double value);
std::string toml_text(const double* values, std::size_t n);
std::string toml_text(const toml::node& node);

}  // namespace corpuscle
