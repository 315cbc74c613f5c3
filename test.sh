#!/usr/bin/env bash
# Set up, build everything and run all tests:
#
#   ./test.sh [ctest options]      for example ./test.sh -R membrane
#
# CORPUSCLE_DEPS  where the dependencies are (see setup.sh)
# CORPUSCLE_JOBS  parallel compile jobs and tests (default: number of cores)
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
case ${1:-} in
  -h|--help) sed -n '2,7s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 0 ;;
esac
deps=${CORPUSCLE_DEPS:-${XDG_CACHE_HOME:-$HOME/.cache}/corpuscle/deps-1}
jobs=${CORPUSCLE_JOBS:-$(nproc)}

cd "$here"
./setup.sh --deps-only
cmake --preset openmp -DCORPUSCLE_DEPS="$deps" > /dev/null
cmake --build build/openmp -j "$jobs"
if [ "$(id -u)" = 0 ]; then # Open MPI asks root to confirm
  export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
fi

status=0
ctest --test-dir build/openmp --output-on-failure -j "$jobs" "$@" || status=$?
if [ $status = 0 ]; then
  echo "== all tests passed"
else
  echo "== some tests failed: build/openmp/Testing/Temporary/LastTest.log has their output" >&2
fi
exit $status
