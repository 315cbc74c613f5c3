#include "core/log.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace corpuscle {
namespace {

struct LogState {
  bool root = true, quiet = false;
  bool line_open = false;  // a progress line without its end
  bool unheard = false;    // stdout is gone
  WarningsTold told;
  spdlog::logger out{"out", std::make_shared<spdlog::sinks::stdout_sink_mt>()};
  spdlog::logger err{"err", std::make_shared<spdlog::sinks::stderr_sink_mt>()};

  LogState() {
    out.set_pattern("%v");
    err.set_pattern("%v");
    out.flush_on(spdlog::level::info);
  }
  void close_line() {
    if (line_open) std::fputc('\n', stdout), std::fflush(stdout);
    line_open = false;
  }
};

LogState& state() {
  static LogState log;
  return log;
}

std::string duration_text(double seconds) {
  const long s = std::lround(seconds);
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {} s", s / 60, s % 60);
  return fmt::format("{} h {} min", s / 3600, s % 3600 / 60);
}

}  // namespace

void open_log(bool root, bool quiet) {
  state().root = root;
  state().quiet = quiet;
}

void log_info(const std::string& message) {
  auto& log = state();
  if (!log.root || log.quiet) return;
  log.close_line();
  log.out.info(message);
  if (std::ferror(stdout) && !std::exchange(log.unheard, true))
    log_warning("what the program says can no longer be written (stdout): it goes on");
}

void log_text(const std::string& text) { log_info(!text.empty() && text.back() == '\n' ? text.substr(0, text.size() - 1) : text); }

void log_warning(const std::string& message) {
  auto& log = state();
  if (!log.root) return;
  log.close_line();
  log.err.warn("warning: " + message);
  constexpr std::size_t most = 100;
  if (log.told.texts.size() < most)
    log.told.texts.push_back(message);
  else
    ++log.told.more;
}

const WarningsTold* warnings_told() { return state().root ? &state().told : nullptr; }

WarningsTold exchange_warnings(WarningsTold told) { return std::exchange(state().told, std::move(told)); }

void log_error(const std::string& message, bool everywhere) {
  auto& log = state();
  if (!log.root && !everywhere) return;
  log.close_line();
  log.err.error("error: " + message);
}

std::string progress_text(double time_us, double end_us, double steps_per_s, double left_s, const std::string& worst, std::size_t room) {
  const double percent = end_us > 0 ? std::floor(1000 * std::min(1.0, time_us / end_us)) / 10 : 100;
  const std::string begin = fmt::format("{:.1f} %  {:g} of {:g} us  ", percent, time_us, end_us),
                    rate = fmt::format("{:.3g} steps/s  ", steps_per_s);
  const std::string left = left_s < 0 ? "" : duration_text(left_s) + " left", end = worst.empty() ? left : left + "  " + worst;
  const bool fits = begin.size() + rate.size() + end.size() <= room;
  return (begin + (fits ? rate : "") + end).substr(0, room);
}

namespace {

std::size_t columns_of_terminal() {
  winsize size{};
  return ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 ? size.ws_col : 80;
}

}  // namespace

Progress::Progress(double end_us, long steps)
    : end_us_(end_us), steps_(steps), terminal_(isatty(STDOUT_FILENO) == 1), shown_(Clock::now()) {}

void Progress::update(long step, double time_us, const std::function<std::string()>& worst) {
  auto& log = state();
  if (!log.root || log.quiet) return;
  const double since = std::chrono::duration<double>(Clock::now() - shown_).count();
  if (since < (terminal_ ? 0.5 : 10.0)) return;
  const double rate = (step - shown_step_) / since;
  rate_ = rate_ > 0 ? 0.7 * rate_ + 0.3 * rate : rate;
  shown_ = Clock::now();
  shown_step_ = step;
  const auto text = progress_text(time_us, end_us_, rate_, rate_ > 0 ? (steps_ - step) / rate_ : -1.0, worst(),
                                  terminal_ ? columns_of_terminal() - 1 : 1000);
  if (terminal_) {
    std::fputs(fmt::format("\r{}\033[K", text).c_str(), stdout);  // and erased to its end; a terminal that is gone stops no run
    std::fflush(stdout);
    log.line_open = true;
  } else {
    log_info(text);
  }
}

void Progress::finish() { state().close_line(); }

}  // namespace corpuscle
