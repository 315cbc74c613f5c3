// Case files that nobody would write: each is read to a case that reads back the same, or refused with an InputError, and soon.
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <sstream>

#include "core/error.hpp"
#include "input/case_file.hpp"
#include "input/key_list.hpp"

using namespace corpuscle;
namespace fs = std::filesystem;

namespace {

using Lines = std::vector<std::string>;

Lines lines_of(const std::string& text) {
  Lines lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::string text_of(const Lines& lines) {
  std::string text;
  for (const auto& line : lines) text += line + "\n";
  return text;
}

/// Changes a case file in ways that a slip of the hand, another program or malice would.
class Mutator {
 public:
  Mutator(std::vector<std::string> corpus, unsigned seed) : corpus_(std::move(corpus)), random_(seed) {
    for (const auto& section : list_keys()) {
      sections_.push_back(section.listed ? "[[" + section.name + "]]" : "[" + section.name + "]");
      for (const auto& key : section.keys) keys_.push_back(key.key);
    }
  }

  std::string next() {
    std::string text = pick(corpus_);
    for (int n = one_of(4) + 1; n > 0; --n) text = one_of(8) == 0 ? bytes(text) : words(lines_of(text));
    return text;
  }

 private:
  std::size_t one_of(std::size_t count) { return count == 0 ? 0 : random_() % count; }
  const std::string& pick(const std::vector<std::string>& list) { return list[one_of(list.size())]; }

  std::string bytes(std::string text) {
    const std::size_t at = one_of(text.size() + 1);
    switch (one_of(4)) {
      case 0:
        return text.substr(0, at);
      case 1:
        return text.insert(at, 1, static_cast<char>(random_() % 256));
      case 2:
        return text.insert(at, std::string(one_of(300) + 1, "[{\"=#.-"[one_of(7)]));
      default:
        if (at < text.size()) text[at] = static_cast<char>(text[at] ^ (1 << one_of(8)));
        return text;
    }
  }

  std::string value() {
    static const std::vector<std::string> values{"0",
                                                 "-1",
                                                 "1",
                                                 "1e308",
                                                 "-1e308",
                                                 "1e-320",
                                                 "nan",
                                                 "inf",
                                                 "-inf",
                                                 "9223372036854775807",
                                                 "-9223372036854775808",
                                                 "2.5",
                                                 "true",
                                                 "false",
                                                 "\"\"",
                                                 "\"x\"",
                                                 "[]",
                                                 "[1]",
                                                 "[[]]",
                                                 "[0, 0, 0]",
                                                 "[1e300, 1e300, 1e300]",
                                                 "[-1, -1, -1]",
                                                 "{a=1}",
                                                 "2147483647",
                                                 "-0.0",
                                                 "1e5",
                                                 "0x10",
                                                 "1979-05-27",
                                                 "''''''",
                                                 "\"/dev/null\"",
                                                 "[nan, 0, 1]",
                                                 "\"\\u0000\""};
    return pick(values);
  }

  /// A line `key = value` with another key or value.
  std::string changed(const std::string& line) {
    const auto at = line.find('=');
    if (at == std::string::npos) return pick(keys_) + " = " + value();
    return one_of(3) == 0 ? pick(keys_) + " " + line.substr(at) : line.substr(0, at + 1) + " " + value();
  }

  std::string words(Lines lines) {
    if (lines.empty()) return pick(corpus_);
    const std::size_t at = one_of(lines.size()), other = one_of(lines.size());
    switch (one_of(8)) {
      case 0:
        lines.erase(lines.begin() + static_cast<long>(at));
        break;
      case 1:
        lines.insert(lines.begin() + static_cast<long>(at), lines[other]);
        break;
      case 2:
        std::swap(lines[at], lines[other]);
        break;
      case 3:
        lines.insert(lines.begin() + static_cast<long>(at), pick(sections_));
        break;
      case 4:
        lines.insert(lines.begin() + static_cast<long>(at), pick(keys_) + " = " + value());
        break;
      case 5: {  // a stretch of another case
        const Lines theirs = lines_of(pick(corpus_));
        const std::size_t from = one_of(theirs.size()), to = std::min(theirs.size(), from + one_of(20));
        lines.insert(lines.begin() + static_cast<long>(at), theirs.begin() + static_cast<long>(from),
                     theirs.begin() + static_cast<long>(to));
        break;
      }
      default:
        lines[at] = changed(lines[at]);
    }
    return text_of(lines);
  }

  std::vector<std::string> corpus_, sections_, keys_;
  std::mt19937_64 random_;
};

unsigned setting(const char* name, unsigned otherwise) {
  const char* text = std::getenv(name);
  return text ? static_cast<unsigned>(std::strtoul(text, nullptr, 10)) : otherwise;
}

}  // namespace

TEST_CASE("whatever a case file holds, it is read or refused") {
  const std::string folder = CORPUSCLE_SOURCE_DIR "/cases";
  std::vector<std::string> corpus;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".toml") corpus.push_back(load_case_file(entry.path().string()).text);
  std::sort(corpus.begin(), corpus.end());
  REQUIRE(corpus.size() > 10);
  const unsigned count = setting("CORPUSCLE_FUZZ", 10000), seed = setting("CORPUSCLE_FUZZ_SEED", 1);
  constexpr double soon_s = 5;
  Mutator mutator(corpus, seed);
  unsigned read = 0, refused = 0;
  for (unsigned n = 0; n < count; ++n) {
    const std::string text = mutator.next();
    INFO("seed " << seed << ", case " << n << ":\n" << text);
    const auto start = std::chrono::steady_clock::now();
    std::string first;
    try {
      const Case scene = read_case(CaseFile{folder + "/fuzzed.toml", text});
      first = resolved_text(scene);
      ++read;
    } catch (const InputError& error) {
      REQUIRE(std::string(error.what()).size() > 10);
      ++refused;
    } catch (const std::exception& error) {
      FAIL("not refused but failed: " << error.what());
    }
    if (!first.empty()) {
      std::string again;
      REQUIRE_NOTHROW(again = resolved_text(read_case(CaseFile{folder + "/fuzzed.toml", first})));
      REQUIRE(again == first);
    }
    REQUIRE(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < soon_s);
  }
  CHECK(read > count / 20);
  CHECK(refused > count / 4);
}
