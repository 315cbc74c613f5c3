#include "membrane/mesh_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "core/error.hpp"

namespace corpuscle {

namespace {

bool blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

/// The word without a leading '+', which from_chars does not take.
std::string_view unsigned_part(std::string_view word) {
  return word.size() > 1 && word[0] == '+' && word[1] != '-' ? word.substr(1) : word;
}

}  // namespace

void refuse_mesh_file(const std::string& path, const std::string& what) { throw InputError(fmt::format("mesh file {}: {}", path, what)); }

std::string lower_case(std::string_view word) {
  std::string lower(word);
  for (char& c : lower) c = char(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

MeshText::MeshText(const std::string& path, std::string text, char comment) : path_(path), text_(std::move(text)) {
  const std::string_view all = text_;
  std::size_t i = all.substr(0, 3) == "\xEF\xBB\xBF" ? 3 : 0;
  for (int line = 1; i < all.size();) {
    const char c = all[i];
    if (c == '\n' || c == '\r') {
      i += c == '\r' && i + 1 < all.size() && all[i + 1] == '\n' ? 2 : 1;
      ++line;
    } else if (blank(c)) {
      ++i;
    } else if (comment != 0 && c == comment) {
      while (i < all.size() && all[i] != '\n' && all[i] != '\r') ++i;
    } else {
      const std::size_t start = i;
      while (i < all.size() && all[i] != '\n' && all[i] != '\r' && !blank(all[i]) && (comment == 0 || all[i] != comment)) ++i;
      words_.push_back({all.substr(start, i - start), line});
    }
  }
}

int MeshText::line() const { return words_.empty() ? 1 : words_[std::min(at_, words_.size() - 1)].line; }

int MeshText::words_left_in_line() const {
  int count = 0;
  for (std::size_t i = at_; i < words_.size() && words_[i].line == words_[at_].line; ++i) ++count;
  return count;
}

long MeshText::lines_left() const {
  long lines = 0;
  int last = 0;
  for (std::size_t i = at_; i < words_.size(); ++i) {
    if (words_[i].line != last) ++lines;
    last = words_[i].line;
  }
  return lines;
}

std::string_view MeshText::word(const char* what) {
  if (end()) refuse_mesh_file(path_, fmt::format("truncated: ends at line {}, where {} should follow", line(), what));
  return words_[at_++].text;
}

std::string MeshText::peek() const { return end() ? "" : lower_case(words_[at_].text); }

double MeshText::number(const char* what) {
  const std::string_view text = word(what), digits = unsigned_part(text);
  double value = 0;
  const auto [stop, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || stop != digits.data() + digits.size() || !std::isfinite(value)) misplaced(text, what);
  return value;
}

long MeshText::integer(const char* what) {
  const std::string_view text = word(what), digits = unsigned_part(text);
  long value = 0;
  const auto [stop, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || stop != digits.data() + digits.size()) misplaced(text, what);
  return value;
}

std::string MeshText::rest_of_line() {
  std::string rest;
  while (same_line()) {
    if (!rest.empty()) rest += ' ';
    rest += words_[at_++].text;
  }
  return rest;
}

void MeshText::fail(const std::string& what) const {
  refuse_mesh_file(path_, fmt::format("line {}: {}", words_.empty() ? 1 : words_[at_ > 0 ? at_ - 1 : 0].line, what));
}

void MeshText::misplaced(std::string_view word, const char* what) const { fail(fmt::format("'{}' stands where {} should", word, what)); }

}  // namespace corpuscle
