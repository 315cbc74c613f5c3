// A run of the program that a test watches, interrupts and kills.
#pragma once

#include <signal.h>

#include <chrono>
#include <functional>
#include <thread>

#include "program.hpp"

namespace app {

/// Started on construction; killed, if it still runs, on destruction.
class Background {
 public:
  Background(const fs::path& folder, const Words& words, const Launch& launch = {}) : folder_(folder) {
    const auto command = command_line(folder, words, launch, "");
    process_ = ::fork();
    if (process_ == 0) {
      ::setpgid(0, 0);
      for (const int signal : {SIGHUP, SIGINT, SIGTERM, SIGUSR1}) ::signal(signal, SIG_DFL);  // the tests may run under nohup
      ::execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
      ::_exit(127);
    }
  }
  ~Background() {
    if (process_ > 0) kill(SIGKILL);
  }
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  /// Wait until the condition holds. @return false if the run ended before, or after that time
  bool wait_until(const std::function<bool()>& condition, std::chrono::milliseconds longest = std::chrono::minutes(1)) {
    const auto end = Clock::now() + longest;
    while (Clock::now() < end) {
      if (condition()) return true;
      if (ended()) return condition();
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return false;
  }
  /// To the program, or to mpirun where there is one.
  void send(int signal) { ::kill(process_, signal); }
  /// All its processes at once, without a chance to clean up. @pre no mpirun, whose ranks are not of this group
  void kill(int signal = SIGKILL) {
    ::kill(-process_, signal);
    wait();
  }
  /// Until it has ended; killed after a minute.
  Outcome wait() {
    if (!wait_until([&] { return ended(); })) ::kill(-process_, SIGKILL), ::waitpid(process_, &status_, 0), process_ = -1;
    return {WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_), contents(folder_ / "screen.txt")};
  }

 private:
  using Clock = std::chrono::steady_clock;
  bool ended() {
    if (process_ > 0 && ::waitpid(process_, &status_, WNOHANG) == process_) process_ = -1;
    return process_ < 0;
  }

  fs::path folder_;
  pid_t process_ = -1;
  int status_ = 0;
};

/// Lines of a file, 0 where there is none.
inline long lines(const fs::path& path) {
  const auto text = contents(path);
  return std::count(text.begin(), text.end(), '\n');
}

}  // namespace app
