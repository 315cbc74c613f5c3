// A case file as it was read, once: it may be a pipe, and the user may change it while the run goes on.
#pragma once

#include "input/case.hpp"

namespace corpuscle {

struct CaseFile {
  std::string path;  // for messages; files that the case names are sought beside it
  std::string text;
};

/// @throws InputError  it cannot be read
CaseFile load_case_file(const std::string& path);

/// As read_case(path), of the file's text.
Case read_case(const CaseFile& file, const std::vector<std::string>& overrides = {});

/// The case with every key that has a value in it, as a case file that gives the same case and no words on keys without effect.
std::string resolved_text(const Case& scene);

}  // namespace corpuscle
