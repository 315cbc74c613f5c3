#!/usr/bin/env bash
# Set up and build if needed, then run a case:
#
#   ./run.sh CASE.toml [--out DIR] [--overwrite] [--set section.key=value]... [--restart CHECKPOINT] [--estimate-error[=KINDS]]
#
# OMP_NUM_THREADS  threads (default: number of cores)
set -euo pipefail
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
case ${1:-} in
  ''|-h|--help) sed -n '2,6s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; [ -n "${1:-}" ] && exit 0 || exit 2 ;;
esac

program=$here/build/openmp/corpuscle
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if [ -x "$program" ]; then
  # Built before: whatever changed is built again, and only a failure is worth a word.
  "$here/setup.sh" > "$log" 2>&1 || { status=$?; cat "$log" >&2; exit "$status"; }
else
  "$here/setup.sh"
fi
rm -f "$log"
trap - EXIT

export OMP_NUM_THREADS=${OMP_NUM_THREADS:-$(nproc)}
# Threads pinned by several runs at once would share cores: leave them to the system.
export OMP_PROC_BIND=${OMP_PROC_BIND:-false}
if [ "$(id -u)" = 0 ]; then # Open MPI asks root to confirm
  export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
fi
exec "$program" run "$@"
