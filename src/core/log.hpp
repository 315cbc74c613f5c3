// What the program says while it runs: on rank 0 only, plain lines.
#pragma once

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

namespace corpuscle {

/// Before the first message: which rank speaks, and how much. Warnings and errors go to stderr, the rest to stdout.
void open_log(bool root, bool quiet = false);

void log_info(const std::string& message);
/// Lines that end themselves, such as those of a file.
void log_text(const std::string& text);
void log_warning(const std::string& message);
/// Also heard from ranks other than 0 when `everywhere` is set: for the rank on which something broke.
void log_error(const std::string& message, bool everywhere = false);

/// What has been warned of so far, on the rank that speaks: the first hundred, and of how many more there is none of the texts.
struct WarningsTold {
  std::vector<std::string> texts;
  long more = 0;
};
/// Null on ranks that do not speak.
const WarningsTold* warnings_told();
/// For a run within a run. @return what has been warned of before
WarningsTold exchange_warnings(WarningsTold told);

template <class... Args>
void info(fmt::format_string<Args...> format, Args&&... args) {
  log_info(fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void warn(fmt::format_string<Args...> format, Args&&... args) {
  log_warning(fmt::format(format, std::forward<Args>(args)...));
}

/// "12.3 %  123 of 1000 us  45.6 steps/s  1 min 20 s left  energy_balance 0.01 of 0.05"
/// @param left_s  negative while there is no estimate yet
/// @param worst   of what is known of errors so far
/// @param room    for so many letters: what is too long lacks the rate, and then its end
std::string progress_text(double time_us, double end_us, double steps_per_s, double left_s, const std::string& worst = "",
                          std::size_t room = 1000);

/// The progress line: rewritten in place on a terminal, otherwise a new line every ten seconds.
class Progress {
 public:
  /// @param steps  all steps of this run, from its start or restart to its end
  Progress(double end_us, long steps);
  ~Progress() { finish(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// After each step: `step` of this run, 1 to `steps`.
  /// @param worst  asked for when the line is written
  void update(long step, double time_us, const std::function<std::string()>& worst);
  /// End the line. Called by the destructor as well.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  double end_us_;
  long steps_;
  bool terminal_;
  Clock::time_point shown_;
  long shown_step_ = 0;
  double rate_ = 0;  // steps/s, recent ones weigh most
};

}  // namespace corpuscle
