// What checkpoints have of the samples, and which of them a restart goes on from.
#include <fmt/format.h>

#include <algorithm>

#include "blood/blood_sampler.hpp"
#include "core/log.hpp"

namespace corpuscle {

namespace {

// Columns before the means.
enum Column { form, from, every, windows, bins, began, columns };
constexpr double present_form = -3;  // states of another one are not read

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// Keys that say how a flow is solved for, not which.
bool only_of_solution(const std::string& key) {
  return key.rfind("time.", 0) == 0 || ends_with(key, "tolerance") || ends_with(key, ".max_iterations");
}

}  // namespace

std::vector<double> BloodSampler::state() const {
  std::vector<double> state{present_form, settings_.from_us, every_us_, static_cast<double>(windows_), static_cast<double>(bins_),
                            began_us_};
  const auto means = means_.state();
  state.insert(state.end(), means.begin(), means.end());
  return state;
}

/// Each as a text. @pre the state has all columns
std::vector<std::string> BloodSampler::other_settings(const std::vector<double>& state) const {
  std::vector<std::string> others;
  const auto compare = [&](const char* key, Column column, double now) {
    if (state[column] != now) others.push_back(fmt::format("blood.{}: {:g}, and it was {:g}", key, now, state[column]));
  };
  compare("from_us", from, settings_.from_us);
  compare("sample_every_us", every, every_us_);
  compare("bins", bins, bins_);
  compare("layer_window_um: windows along the flow", windows, windows_);
  return others;
}

void BloodSampler::resume(const std::vector<double>& state, const std::vector<std::string>& changed) {
  if (state.empty()) {
    began_us_ = std::max(began_us_, simulation_.time());
    return;
  }
  std::vector<std::string> others;
  bool any = true;
  if (state.size() > columns && state[form] == present_form) {
    others = other_settings(state);
    for (const std::string& key : changed)
      if (!only_of_solution(key)) others.push_back(key);
    RunningMeans before(means_.quantities());
    const bool read = before.set_state({state.begin() + columns, state.end()});
    any = !read || before.samples() > 0;
    if (read && others.empty()) {
      means_ = before;
      began_us_ = state[began];
      return;
    }
  }
  began_us_ = std::max(began_us_, simulation_.time());
  if (!any) return;
  warn("blood: what was sampled until the checkpoint is of another flow, or was taken otherwise ({}): sampling begins anew",
       others.empty() ? "by another version of the program" : fmt::format("{}", fmt::join(others, "; ")));
}

}  // namespace corpuscle
