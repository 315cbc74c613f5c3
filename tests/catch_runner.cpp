// Catch2's own code, by itself: what is compiled here takes long, and need not be fast.
#define CATCH_CONFIG_RUNNER
#include <catch2/catch.hpp>

int run_tests(int argc, char** argv, bool quiet) {
  Catch::Session session;
  if (quiet) session.configData().outputFilename = "%debug";
  const int failed = session.applyCommandLine(argc, argv);
  return failed == 0 ? session.run() : failed;
}
