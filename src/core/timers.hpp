// Wall-clock time by part of the program.
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

namespace corpuscle {

/// Time of each named part, without the parts nested in it, so that all of them add up to no more than the whole.
/// Each part is a profiling region of the same name.
class Timers {
 public:
  /// @param wait  for the device before a clock is read. Else a device's work counts where something is next waited for: that costs
  ///              nothing, and all parts together take as long. On processors there is nothing to wait for.
  explicit Timers(bool wait = true) : wait_(wait) {}

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

  bool wait_;
  std::vector<Part> parts_;
  std::vector<std::size_t> running_;  // innermost last
  Clock::time_point since_;
};

}  // namespace corpuscle
