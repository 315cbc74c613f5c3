#include "input/section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/error.hpp"
#include "core/nearest.hpp"

namespace corpuscle {

namespace {

/// Large limits are powers of ten: 1e+12 rather than all its zeros.
std::string limit_text(double limit) { return std::abs(limit) >= 1e9 ? fmt::format("{:g}", limit) : fmt::format("{}", limit); }

}  // namespace

Bounds positive(double high) {
  return {0, high, true, high < 1e300 ? "a number above 0, at most " + limit_text(high) : "a number above 0"};
}
Bounds not_negative(double high) {
  return {0, high, false, high < 1e300 ? "a number from 0 to " + limit_text(high) : "a number, 0 or more"};
}
Bounds between(double low, double high) {
  return {low, high, false, fmt::format("a number from {} to {}", limit_text(low), limit_text(high))};
}

std::string toml_text(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      quoted += fmt::format("\\u{:04x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}
std::string toml_text(double value) { return fmt::format("{}", value + 0.0); }  // no -0: a whole number when it is read again
std::string toml_text(const double* values, std::size_t n) {
  std::string text;
  for (std::size_t m = 0; m < n; ++m) text += (m > 0 ? ", " : "") + toml_text(values[m]);
  return "[" + text + "]";
}
namespace {

std::string whole_text(const toml::node& node) {
  if (const auto* list = node.as_array()) {
    std::string text;
    for (const auto& entry : *list) text += (text.empty() ? "" : ", ") + whole_text(entry);
    return "[" + text + "]";
  }
  if (node.is_string()) return toml_text(*node.value<std::string>());
  if (node.is_boolean()) return *node.value<bool>() ? "true" : "false";
  if (node.is_number()) return toml_text(*node.value<double>());
  return node.is_table() ? "{...}" : "a date or time";
}

}  // namespace

std::string toml_text(const toml::node& node) {
  constexpr std::size_t longest = 120;
  const std::string dots = "...";
  auto text = whole_text(node);
  if (text.size() > longest) text.replace(longest - dots.size(), std::string::npos, dots);
  return text;
}

Section::Section(const CaseSource& source, std::string path, const toml::table* table)
    : source_(source), path_(std::move(path)), table_(table) {}

void Section::know(const std::string& key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.push_back(key);
}

const toml::node* Section::node(const std::string& key) {
  know(key);
  return table_ ? table_->get(key) : nullptr;
}

double Section::number(const Key& wanted, const Bounds& allowed, std::optional<double> fallback) {
  const std::string& key = wanted.name;
  record(wanted, allowed.text, fallback ? toml_text(*fallback) : "", fallback.has_value());
  const auto* found = node(key);
  if (!found && !fallback) return miss(key, allowed.text), 0;
  const double value = found ? number_in(key, *found, allowed) : *fallback;
  echo_line(key, toml_text(value));
  return value;
}

int Section::integer(const Key& wanted, int low, int high, std::optional<int> fallback) {
  const std::string& key = wanted.name;
  const auto allowed = fmt::format("a whole number from {} to {}", low, high);
  record(wanted, allowed, fallback ? std::to_string(*fallback) : "", fallback.has_value());
  const auto* found = node(key);
  if (!found && !fallback) return miss(key, allowed), low;
  if (found && (!found->is_integer() || *found->value<std::int64_t>() < low || *found->value<std::int64_t>() > high))
    fail(key, "must be " + allowed + (found->is_floating_point() ? ", written without a decimal point or exponent" : ""));
  const int value = found ? static_cast<int>(*found->value<std::int64_t>()) : *fallback;
  echo_line(key, std::to_string(value));
  return value;
}

bool Section::flag(const Key& wanted, bool fallback) {
  const std::string& key = wanted.name;
  record(wanted, "true or false", fallback ? "true" : "false", true);
  const auto* found = node(key);
  if (found && !found->is_boolean()) fail(key, "must be true or false");
  const bool value = found ? *found->value<bool>() : fallback;
  echo_line(key, value ? "true" : "false");
  return value;
}

std::string Section::text(const Key& wanted, std::optional<std::string> fallback) {
  const std::string& key = wanted.name;
  record(wanted, "a text in quotes", fallback ? toml_text(*fallback) : "", fallback.has_value());
  const auto* found = node(key);
  if (!found && !fallback) return miss(key, "a text in quotes"), "";
  if (found && !found->is_string()) fail(key, "must be a text in quotes");
  const auto value = found ? *found->value<std::string>() : *fallback;
  echo_line(key, toml_text(value));
  return value;
}

Triple Section::triple(const Key& wanted, const Bounds& allowed, std::optional<Triple> fallback) {
  const std::string& key = wanted.name;
  const auto description = "three numbers [x, y, z], each " + allowed.text;
  record(wanted, description, fallback ? toml_text(fallback->data(), 3) : "", fallback.has_value());
  const auto* found = node(key);
  if (!found && !fallback) return miss(key, description), Triple{};
  Triple value = fallback.value_or(Triple{});
  if (found) {
    const auto numbers = numbers_in(key, *found, 3, description);
    for (int d = 0; d < 3; ++d) {
      value[d] = numbers[d];
      if (!allowed.contains(value[d])) fail(key, "must be " + description);
    }
  }
  echo_line(key, toml_text(value.data(), 3));
  return value;
}

std::array<int, 3> Section::integers(const Key& wanted, int low, int high) {
  const std::string& key = wanted.name;
  const auto allowed = fmt::format("three whole numbers [i, j, k], each from {} to {}", low, high);
  record(wanted, allowed, "", false);
  const auto* found = node(key);
  if (!found) return miss(key, allowed), std::array<int, 3>{low, low, low};
  const auto* list = found->as_array();
  if (!list || list->size() != 3) fail(key, "must be " + allowed);
  std::array<int, 3> values{};
  for (int d = 0; d < 3; ++d) {
    const auto* entry = list->get_as<std::int64_t>(d);
    if (!entry || entry->get() < low || entry->get() > high) fail(key, "must be " + allowed);
    values[d] = static_cast<int>(entry->get());
  }
  echo_line(key, fmt::format("[{}]", fmt::join(values, ", ")));
  return values;
}

template <std::size_t N>
std::vector<std::array<double, N>> Section::rows(const Key& wanted, std::size_t min_rows) {
  const std::string& key = wanted.name;
  const auto allowed =
      fmt::format("a list of {} or more rows of {} numbers, such as [[{}], ...]", min_rows, N, N == 2 ? "0, 1" : "0, 0, 1");
  std::vector<std::array<double, N>> values;
  record(wanted, allowed, "", true);
  const auto* found = node(key);
  if (!found) return values;
  const auto* list = found->as_array();
  if (!list || list->size() < min_rows) fail(key, "must be " + allowed);
  std::string text;
  for (const auto& row : *list) {
    const auto numbers = numbers_in(key, row, N, allowed);
    std::copy(numbers.begin(), numbers.end(), values.emplace_back().begin());
    text += (text.empty() ? "" : ", ") + toml_text(numbers.data(), N);
  }
  echo_line(key, "[" + text + "]");
  return values;
}
template std::vector<std::array<double, 2>> Section::rows<2>(const Key&, std::size_t);
template std::vector<std::array<double, 3>> Section::rows<3>(const Key&, std::size_t);

std::string Section::file(const Key& wanted, bool required) {
  const std::string& key = wanted.name;
  if (recorder_) {
    record(wanted, "the path of a file, in quotes", "", !required);
    know(key);
    if (!required) recorder_->choices[key] = {"none", "a file"};
    const bool given = required || (recorder_->chosen.count(key) && recorder_->chosen[key] == 1);
    return given ? "recorded.off" : "";
  }
  const auto* found = node(key);
  if (!found) {
    if (required) miss(key, "the path of a file, in quotes");
    return "";
  }
  if (!found->is_string() || found->value<std::string>()->empty()) fail(key, "must be the path of a file, in quotes");
  std::filesystem::path path = *found->value<std::string>();
  if (path.is_relative()) path = std::filesystem::path(source_.folder) / path;
  path = std::filesystem::absolute(path).lexically_normal();
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored))
    fail(key, fmt::format("there is no file {} (relative paths start at the folder of the case file)", path.string()));
  echo_line(key, toml_text(path.string()));
  return path.string();
}

void Section::unused(const std::string& key, const std::string& why) {
  if (recorder_) recorder_->unused.emplace(key, why);
  if (node(key)) fail(key, why);
}

void Section::require(const Key& key, const std::string& allowed) {
  record(key, allowed, "", false);
  if (!has(key.name)) miss(key.name, allowed);
}

void Section::record(const Key& key, const std::string& allowed, const std::string& value, bool optional) {
  if (!recorder_) return;
  for (auto& known : recorder_->keys)
    if (known.key == key.name) {
      if (!optional) known.allowed = allowed, known.optional = false;  // required after all
      return;
    }
  recorder_->keys.push_back({key.name, key.what, allowed, value, optional, ""});
}

void Section::finish() {
  if (recorder_) return;
  if (table_) {
    for (const auto& [key, value] : *table_) {
      const std::string name(key.str());
      if (std::find(known_.begin(), known_.end(), name) != known_.end()) continue;
      const auto like = nearest(name, known_);
      const bool unit = !like.empty() && without_unit(like) == without_unit(name);
      if (like.empty()) fail(name, fmt::format("unknown key; known here: {}", fmt::join(known_, ", ")));
      fail(name,
           fmt::format("unknown key; did you mean '{}'?{}", like, unit ? " The unit is part of the name: convert the value to it." : ""));
    }
  }
  if (missing_.empty()) return;
  const auto& [key, allowed] = missing_.front();
  fail(key, "required key is missing; it must be " + allowed);
}

std::vector<std::string> Section::present() const {
  std::vector<std::string> keys;
  if (table_)
    for (const auto& [key, value] : *table_) keys.emplace_back(key.str());
  return keys;
}

std::string Section::echo() const {
  std::string text;
  for (const auto& [key, value] : echo_) text += key + " = " + value + "\n";
  return text;
}

void Section::fail(const std::string& key, const std::string& problem) const {
  if (recorder_) throw RecordingEnds();
  const auto* found = table_ ? table_->get(key) : nullptr;
  const auto value = found ? " = " + toml_text(*found) : "";
  const auto name = key.empty() ? path_ : path_.empty() ? key : path_ + "." + key;
  throw InputError(fmt::format("{}: {}{}{}{}", where(key), name, value, name.empty() ? "" : ": ", problem));
}

std::size_t Section::word(const Key& wanted, const std::vector<std::string>& names, std::size_t fallback) {
  const std::string& key = wanted.name;
  const auto allowed = fmt::format("one of \"{}\"", fmt::join(names, "\", \""));
  if (recorder_) {
    record(wanted, allowed, fallback < names.size() ? toml_text(names[fallback]) : "", fallback < names.size());
    know(key);
    recorder_->choices[key] = names;
    const auto chosen = recorder_->chosen.find(key);
    return chosen != recorder_->chosen.end() ? chosen->second : std::min(fallback, names.size() - 1);
  }
  const auto* found = node(key);
  if (!found && fallback >= names.size()) {
    for (const auto& [other, value] : table_ ? *table_ : toml::table{})
      if (nearest(other.str(), {key}) == key) fail(std::string(other.str()), fmt::format("unknown key; did you mean '{}'?", key));
    fail(key, "required key is missing; it must be " + allowed);
  }
  if (found) {
    if (!found->is_string()) fail(key, "must be " + allowed);
    const auto text = *found->value<std::string>();
    fallback = std::find(names.begin(), names.end(), text) - names.begin();
    if (fallback == names.size()) {
      const auto like = nearest(text, names);
      fail(key, fmt::format("must be {}{}", allowed, like.empty() ? "" : fmt::format("; did you mean \"{}\"?", like)));
    }
  }
  echo_line(key, toml_text(names[fallback]));
  return fallback;
}

double Section::number_in(const std::string& key, const toml::node& node, const Bounds& allowed) const {
  if (!node.is_number()) fail(key, "must be " + allowed.text);
  const double value = *node.value<double>();
  if (!std::isfinite(value) || !allowed.contains(value)) fail(key, "must be " + allowed.text);
  return value;
}

std::vector<double> Section::numbers_in(const std::string& key, const toml::node& node, std::size_t count,
                                        const std::string& allowed) const {
  const auto* list = node.as_array();
  if (!list || list->size() != count) fail(key, "must be " + allowed);
  std::vector<double> values;
  for (const auto& entry : *list) {
    if (!entry.is_number() || !std::isfinite(*entry.value<double>())) fail(key, "must be " + allowed);
    values.push_back(*entry.value<double>());
  }
  return values;
}

std::string Section::where(const std::string& key) const {
  const auto set = source_.overrides.find(path_.empty() ? key : path_ + "." + key);
  if (set != source_.overrides.end()) return "--set " + set->second;
  const auto* found = table_ ? table_->get(key) : nullptr;
  const auto line = found ? found->source().begin.line : (table_ ? table_->source().begin.line : 0);
  return line > 0 ? fmt::format("{}:{}", source_.file, line) : source_.file;
}

}  // namespace corpuscle
