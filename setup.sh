#!/usr/bin/env bash
# Set up Corpuscle on Debian 12 (or a close relative): system packages, the three libraries that need OpenMP,
# and the program itself. Safe to run again: every step that is already done is skipped.
#
#   ./setup.sh              packages, dependencies, build/openmp/corpuscle
#   ./setup.sh --deps-only  packages and dependencies, no build
#   ./setup.sh --no-mpi     also a hypre without MPI, for builds with -DCORPUSCLE_MPI=OFF
#
# CORPUSCLE_DEPS  where the dependencies go (default ~/.cache/corpuscle/deps-1)
# CORPUSCLE_JOBS  parallel compile jobs (default: number of cores)
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
deps=${CORPUSCLE_DEPS:-${XDG_CACHE_HOME:-$HOME/.cache}/corpuscle/deps-1}
jobs=${CORPUSCLE_JOBS:-$(nproc)}
build=yes sequential_hypre=no
for option in "$@"; do
  case $option in
    --deps-only) build=no ;;
    --no-mpi) sequential_hypre=yes ;;
    -h|--help) sed -n '2,10s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 0 ;;
    *) echo "setup.sh: unknown option '$option' (see ./setup.sh --help)" >&2; exit 2 ;;
  esac
done

say() { printf '== %s\n' "$*"; }
fail() { printf 'setup.sh: %s\n' "$*" >&2; exit 1; }
trap 'fail "stopped at line $LINENO; the output above says why. Running ./setup.sh again continues from here."' ERR

packages=(build-essential cmake ninja-build pkg-config git ca-certificates dpkg-dev
  libopenmpi-dev openmpi-bin libhdf5-openmpi-dev catch2 libtomlplusplus-dev libcli11-dev libfmt-dev
  libspdlog-dev nlohmann-json3-dev libqhull-dev liblapack-dev clang-format python3 python3-h5py python3-matplotlib)

as_root() {
  if [ "$(id -u)" = 0 ]; then "$@"
  elif command -v sudo >/dev/null; then sudo "$@"
  else fail "need root to install ${missing[*]}: run as root, install sudo, or install these packages by hand"
  fi
}

missing=()
if command -v dpkg-query >/dev/null; then
  for p in "${packages[@]}"; do
    [ "$(dpkg-query -W -f='${Status}' "$p" 2>/dev/null)" = 'install ok installed' ] || missing+=("$p")
  done
else
  say "not a Debian system: using the packages that CMake finds (see README, Dependencies)"
fi
if [ ${#missing[@]} -gt 0 ]; then
  say "installing ${#missing[@]} Debian packages: ${missing[*]}"
  as_root env DEBIAN_FRONTEND=noninteractive apt-get update -qq
  as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
fi

# Debian's Kokkos is serial and its hypre has no OpenMP, so these come from Debian's own source packages.
# The deb-src list is private to this script: the system's package sources stay as they are.
work=$deps/work
fetch_source() {
  command -v apt-get >/dev/null || fail "Kokkos, Kokkos Kernels and hypre with OpenMP are needed in $deps or on CMAKE_PREFIX_PATH"
  local apt=$work/apt
  mkdir -p "$apt/sources.list.d" "$apt/lists/partial" "$apt/cache/archives/partial"
  local f
  : > "$apt/sources.list"
  for f in /etc/apt/sources.list /etc/apt/sources.list.d/*.list; do
    [ -f "$f" ] && sed -n 's/^deb\([[:space:]]\)/deb-src\1/p' "$f" >> "$apt/sources.list"
  done
  for f in /etc/apt/sources.list.d/*.sources; do
    [ -f "$f" ] && sed 's/^Types:.*/Types: deb-src/' "$f" > "$apt/sources.list.d/$(basename "$f")"
  done
  local options=(-o "Dir::Etc::sourcelist=$apt/sources.list" -o "Dir::Etc::sourceparts=$apt/sources.list.d"
    -o "Dir::State::lists=$apt/lists" -o "Dir::Cache=$apt/cache" -o APT::Sandbox::User=root)
  (cd "$work" && apt-get "${options[@]}" -qq update && apt-get "${options[@]}" -qq source --download-only "$1")
}

cmake_install() { # source folder, build folder name, options...
  local source=$1 name=$2
  shift 2
  cmake -G Ninja -S "$source" -B "$work/$name" -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_LIBDIR=lib \
    -DCMAKE_POSITION_INDEPENDENT_CODE=ON "$@" > "$work/$name.log" 2>&1 \
    && cmake --build "$work/$name" -j "$jobs" --target install >> "$work/$name.log" 2>&1 \
    || { tail -n 30 "$work/$name.log" >&2; fail "building $name failed; the whole log is $work/$name.log"; }
  touch "$deps/.$name"
}

mkdir -p "$deps" "$work"
exec 9> "$deps/.lock"
if command -v flock >/dev/null; then flock 9; fi
if [ ! -f "$deps/.kokkos" ] || [ ! -f "$deps/.kokkos-kernels" ]; then
  say "fetching Kokkos and Kokkos Kernels (in Debian's trilinos source, 170 MB)"
  fetch_source trilinos
  rm -rf "$work/trilinos" && mkdir "$work/trilinos"
  tar -C "$work/trilinos" --strip-components=2 --wildcards -xf "$work"/trilinos_*.orig.tar.* \
    '*/packages/kokkos/*' '*/packages/kokkos-kernels/*'
  say "building Kokkos"
  cmake_install "$work/trilinos/kokkos" kokkos -DCMAKE_INSTALL_PREFIX="$deps" -DCMAKE_CXX_STANDARD=17 \
    -DKokkos_ENABLE_OPENMP=ON -DKokkos_ENABLE_SERIAL=ON -DKokkos_ENABLE_TESTS=OFF -DBUILD_SHARED_LIBS=OFF
  say "building Kokkos Kernels"
  cmake_install "$work/trilinos/kokkos-kernels" kokkos-kernels -DCMAKE_INSTALL_PREFIX="$deps" \
    -DCMAKE_PREFIX_PATH="$deps" -DCMAKE_CXX_STANDARD=17 -DKokkosKernels_ADD_DEFAULT_ETI=OFF \
    -DKokkosKernels_ENABLE_TESTS=OFF -DBUILD_SHARED_LIBS=OFF
fi
if [ ! -f "$deps/.hypre" ] || { [ $sequential_hypre = yes ] && [ ! -f "$deps/.hypre-sequential" ]; }; then
  say "fetching hypre"
  fetch_source hypre
  rm -rf "$work/hypre-source" && mkdir "$work/hypre-source"
  tar -C "$work/hypre-source" --strip-components=1 -xf "$work"/hypre_*.orig.tar.*
fi
if [ ! -f "$deps/.hypre" ]; then
  say "building hypre (about a minute on two cores)"
  cmake_install "$work/hypre-source/src" hypre -DHYPRE_INSTALL_PREFIX="$deps" -DCMAKE_INSTALL_PREFIX="$deps" \
    -DHYPRE_WITH_OPENMP=ON -DHYPRE_WITH_MPI=ON
fi
if [ $sequential_hypre = yes ] && [ ! -f "$deps/.hypre-sequential" ]; then
  say "building hypre without MPI"
  cmake_install "$work/hypre-source/src" hypre-sequential -DHYPRE_INSTALL_PREFIX="$deps/sequential" \
    -DCMAKE_INSTALL_PREFIX="$deps/sequential" -DHYPRE_WITH_OPENMP=ON -DHYPRE_WITH_MPI=OFF
fi
rm -rf "$work/trilinos" "$work"/trilinos_* "$work/hypre-source" "$work"/hypre_*
exec 9>&-

if [ $build = yes ]; then
  cd "$here"
  say "building Corpuscle in build/openmp"
  [ -f build/openmp/build.ninja ] || cmake --preset openmp -DCORPUSCLE_DEPS="$deps" > /dev/null
  cmake --build build/openmp -j "$jobs" --target corpuscle
fi
