// Standard errors of correlated samples.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "blood/running_means.hpp"

using namespace corpuscle;

namespace {

/// Samples of which each remembers the share `memory` of the one before, of variance one, around 10; and a constant.
RunningMeans sampled(double memory, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  RunningMeans means(3);
  double x = normal(random);
  for (int n = 0; n < count; ++n) {
    means.add({10 + x, 7, std::nan("")});
    x = memory * x + std::sqrt(1 - memory * memory) * normal(random);
  }
  return means;
}

}  // namespace

TEST_CASE("standard errors are those of correlated samples", "[blood]") {
  for (const double memory : {0.0, 0.8, 0.95}) {
    // Over many series the mean's spread is what the error says, not the smaller one of samples that know nothing of
    // each other.
    constexpr int series = 40, count = 16000;
    double spread = 0, error = 0, chance = 0, correlation = 0;
    int told = 0, drifts = 0;
    for (int s = 0; s < series; ++s) {
      const auto means = sampled(memory, count, 100 + s);
      spread += std::pow(means.mean(0) - 10, 2) / series;
      const RunningMean& one = means.of(0);
      told += one.error_known();
      if (one.error_known()) error += means.error(0), correlation += one.correlation();
      if (const double drift = one.drift_over_chance(); std::isfinite(drift)) chance += drift * drift, ++drifts;
    }
    error /= told, correlation /= told, chance /= drifts;
    CHECK(told > 0.75 * series);
    const double exact = std::sqrt((1 + memory) / (1 - memory) / count);
    INFO("memory " << memory << ": exact " << exact << ", told " << error << ", seen " << std::sqrt(spread));
    CHECK(error > 0.9 * exact);
    CHECK(error < 1.5 * exact);                             // the largest of several estimates: a little high
    CHECK(std::sqrt(chance) == Approx(0.85).margin(0.35));  // one, and less as errors are told a little high
    CHECK(std::sqrt(spread) == Approx(exact).epsilon(0.35));
    CHECK(correlation == Approx(0.5 * (1 + memory) / (1 - memory)).epsilon(0.35));  // as the error, squared
  }
}

TEST_CASE("a trend is told from chance", "[blood]") {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  RunningMeans means(2);
  constexpr int count = 400;
  for (int n = 0; n < count; ++n) means.add({5 + 0.01 * n, 5 + 0.01 * n + normal(random)});
  CHECK(means.of(0).drift() == Approx(0.01 * (count - 1)).epsilon(1e-12));
  CHECK(means.of(0).drift_over_chance() > 3);
  CHECK(means.of(1).drift() == Approx(0.01 * (count - 1)).epsilon(0.1));
  CHECK(means.of(1).drift_over_chance() > 3);
  CHECK_FALSE(means.of(0).error_known());  // of what drifts throughout there is no mean
}

TEST_CASE("of too short a series neither the error nor that it is steady is told", "[blood]") {
  // Samples that are alike for 20 of them: of 100 the blocks tell a third of the error.
  const double memory = std::exp(-1.0 / 20);
  constexpr int series = 60;
  const auto told = [&](int count) {
    int errors = 0, drifts = 0;
    for (int s = 0; s < series; ++s) {
      const auto means = sampled(memory, count, 500 + s);
      errors += std::isfinite(means.error(0));
      drifts += std::isfinite(means.of(0).drift_over_chance());
      CHECK(means.of(0).least_error() > 0);
      CHECK(means.of(0).effective_samples() < count);
    }
    return std::array<double, 2>{static_cast<double>(errors) / series, static_cast<double>(drifts) / series};
  };
  CHECK(told(100)[0] < 0.03);  // one of 60 by chance
  CHECK(told(100)[1] < 0.07);
  CHECK(told(4000)[0] > 0.6);
}

TEST_CASE("a value that is not a number is no sample of its quantity", "[blood]") {
  RunningMeans means(2);
  for (int n = 0; n < 40; ++n) means.add({n % 4 == 0 ? std::nan("") : 3.0 + n % 2, 1});
  CHECK(means.samples() == 40);
  CHECK(means.of(0).samples() == 30);
  CHECK(means.mean(0) == Approx(3 + 20.0 / 30));
  CHECK(means.of(1).samples() == 40);
}

TEST_CASE("means know what they do not know, and go on from a state", "[blood]") {
  const auto few = sampled(0, 15, 3);
  CHECK(std::isfinite(few.mean(0)));
  CHECK(std::isnan(few.error(0)));
  CHECK(std::isnan(RunningMeans(1).mean(0)));
  const auto all = sampled(0.3, 200, 3);
  CHECK(all.samples() == 200);
  CHECK(all.mean(1) == 7);
  CHECK(all.error(1) == 0);
  CHECK(std::isnan(all.mean(2)));
  CHECK(std::isnan(all.error(2)));
  RunningMeans again(3);
  REQUIRE(again.set_state(all.state()));
  RunningMeans went_on = all;
  for (int n = 0; n < 37; ++n)
    for (auto* means : {&again, &went_on}) means->add({std::sin(n), n * 0.1, 1});
  CHECK(again.mean(0) == went_on.mean(0));
  CHECK(again.of(0).least_error() == went_on.of(0).least_error());
  CHECK(again.of(0).drift() == went_on.of(0).drift());
  CHECK(again.samples() == 237);
  RunningMeans other(4);
  CHECK_FALSE(other.set_state(all.state()));
  CHECK(other.samples() == 0);
}
