// Wall-clock time by part of the program.
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

namespace corpuscle {

/// Time of each named part, without the parts nested in it, so that all of them add up to no more than the whole.
/// Device work is waited for before a clock is read, and each part is a profiling region of the same name.
class Timers {
 public:
  class Scope {
   public:
    Scope(Timers& timers, const char* part) : timers_(timers) { timers_.start(part); }
    ~Scope() { timers_.stop(); }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    Timers& timers_;
  };

  /// Count what follows, until the end of the returned object's life, as `part`.
  [[nodiscard]] Scope scope(const char* part) { return {*this, part}; }
  void start(const char* part);
  /// End the part started last.
  void stop();

  /// Seconds by part, of this rank.
  std::map<std::string, double> seconds() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Part {
    std::string name;
    double seconds;
  };
  void charge();

  std::vector<Part> parts_;
  std::vector<std::size_t> running_;  // innermost last
  Clock::time_point since_;
};

}  // namespace corpuscle
