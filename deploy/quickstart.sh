#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# From a bare Debian 12 to two solved systems: installs missing packages, builds a release, starts dlcsd with a store
# and its web page, and solves through it with live iterates. On a terminal the server then runs until Ctrl-C; elsewhere
# it is stopped. A second run takes seconds. Works from any folder.
#
# It builds with Clang, which needs two thirds of GCC's time for this.
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
build="$root/build/quickstart"
# shellcheck source-path=SCRIPTDIR source=progress.sh
source "$root/deploy/progress.sh"
work=$(mktemp -d)
server=
packages=

clean_up() {
  local code=$?
  trap - EXIT
  [ -z "$packages" ] || wait "$packages" || true # never end apt while it installs
  if [ -n "$server" ]; then
    kill "$server" 2>/dev/null || true
    wait "$server" 2>/dev/null || true
  fi
  if [ "$code" != 0 ]; then
    for log in "$work"/*.log; do
      [ ! -s "$log" ] || { echo "--- the end of $(basename "$log") ---"; tail -n 40 "$log"; } >&2
    done
    echo "quickstart: failed with exit code $code." >&2
  fi
  rm -rf "$work"
  exit "$code"
}
trap clean_up EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

headline() { printf '\n=== %s\n' "$*"; }

build_release() { # SERVICE TARGET...: ON, or OFF for the engine alone
  cmake -S "$root" -B "$build" -G Ninja -DCMAKE_CXX_COMPILER=clang++-14 -DCMAKE_BUILD_TYPE=Release \
    -DDLCS_UNITY_BUILD=ON -DDLCS_BUILD_TESTS=OFF -DDLCS_BUILD_SERVICE="$1" >"$work/cmake.log" 2>&1
  cmake --build "$build" --target "${@:2}" 2>&1 | tee "$work/build.log" | show_progress
}

# The engine is more than half of the build and needs few packages. The first time it is compiled while the others are
# installed. (Later, a configuration for the engine alone would delete the compiled service.)
install_and_build() {
  "$root/deploy/install-packages.sh" engine clang
  "$root/deploy/install-packages.sh" build >"$work/packages.log" 2>&1 &
  packages=$!
  [ -f "$build/build.ninja" ] || build_release OFF dlcs_core
  wait "$packages"
  packages=
  build_release ON dlcs dlcsd
}

# Sets `server`, `address` and `page`. Port 0: the system picks a free one, and dlcsd prints it.
start_server() {
  "$build/server/dlcsd" --listen 127.0.0.1:0 --http-listen 127.0.0.1:0 --store "$build/jobs.db" --log-level warn \
    >"$work/address" 2>"$work/dlcsd.log" &
  server=$!
  for _ in $(seq 100); do
    address=$(sed -n 's/^dlcsd listening on //p' "$work/address")
    page=$(sed -n 's/^dlcsd page on //p' "$work/address")
    [ -z "$page" ] || return 0
    kill -0 "$server" 2>/dev/null || break
    sleep 0.1
  done
  echo "quickstart: dlcsd did not start." >&2
  return 1
}

solve() { # PROBLEM OPTION...
  local problem=$1
  shift
  headline "dlcs solve ${problem#"$root"/} --server $address $*"
  "$build/client/dlcs" solve "$problem" --server "$address" "$@"
}

start=$SECONDS
headline "Packages and build (the first time takes five to ten minutes on two cores)"
install_and_build
echo "Built $build/client/dlcs and $build/server/dlcsd in $((SECONDS - start)) s."

start_server
echo "dlcsd serves on $address."

solve "$root/deploy/examples/example-4.1.json" --steps 128000 --method laplace-iteration
solve "$root/tests/cases/rlcd.json"

headline "dlcs submit, which keeps a solve on the server"
for example in rectifier four-variables; do
  "$build/client/dlcs" submit "$root/deploy/examples/$example.json" --server "$address" --wait --quiet
done

headline "Done in $((SECONDS - start)) s. Try yourself:"
echo "  $build/client/dlcs solve $root/deploy/examples/rectifier.json"
echo "  $build/client/dlcs --help"
if [ -t 0 ] && [ -t 1 ]; then
  echo "The page with these solves: $page  (Ctrl-C stops the server)"
  wait "$server" || true
else
  echo "For the page with these solves, start the server again and open http://127.0.0.1:8080/:"
  echo "  $build/server/dlcsd --store $build/jobs.db --http-listen 127.0.0.1:8080"
fi
