// The words of a mesh file kept as text, each with its line, for readers that say where a file is damaged.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace corpuscle {

[[noreturn]] void refuse_mesh_file(const std::string& path, const std::string& what);

class MeshText {
 public:
  /// Lines may end in LF, CR LF or CR; a byte order mark is skipped.
  /// @param comment  begins a comment that reaches to the end of its line; 0: there are none
  MeshText(const std::string& path, std::string text, char comment);

  bool end() const { return at_ == words_.size(); }
  /// Line of the next word, from 1; at the end that of the last one.
  int line() const;
  /// Whether the next word follows on the line of the last one taken.
  bool same_line() const { return at_ > 0 && !end() && words_[at_].line == words_[at_ - 1].line; }
  /// Words from the next one to the end of its line.
  int words_left_in_line() const;
  /// Lines that hold a word, from the next word's on.
  long lines_left() const;

  /// Take the next word. @param what  what should stand there, for the message at the end of the file
  std::string_view word(const char* what);
  /// The next word without taking it, in lower case; "" at the end.
  std::string peek() const;
  double number(const char* what);
  long integer(const char* what);
  /// Take what is left of the last word's line.
  std::string rest_of_line();

  /// @throws InputError  naming the file and the line of the word last taken
  [[noreturn]] void fail(const std::string& what) const;

 private:
  struct Word {
    std::string_view text;
    int line;
  };
  [[noreturn]] void misplaced(std::string_view word, const char* what) const;

  const std::string& path_;
  std::string text_;
  std::vector<Word> words_;
  std::size_t at_ = 0;
};

std::string lower_case(std::string_view word);

}  // namespace corpuscle
