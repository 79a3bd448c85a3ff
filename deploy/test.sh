#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds everything and runs every test. The last line is `N passed, N failed`; a
# build that fails counts as one failure. Works from any folder.
#
#     deploy/test.sh [PRESET]     release (default), ci (warnings are errors), debug, asan
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
preset=${1:-release}
passed=0
failed=1 # until the tests have said otherwise

# shellcheck disable=SC2317 # the trap calls it
finish() {
  local code=$?
  trap - EXIT
  [ "$failed" = 0 ] || [ "$code" != 0 ] || code=1
  echo "$passed passed, $failed failed"
  exit "$code"
}
trap finish EXIT

cd "$root"
deploy/install-packages.sh build test
cmake --preset "$preset" >/dev/null
cmake --build --preset "$preset"

results="$root/build/$preset/ctest.xml"
rm -f "$results"
code=0
ctest --preset "$preset" --parallel 2 --no-tests=error --output-junit "$results" || code=$?

# The first element holds the totals.
total_of() { # ATTRIBUTE
  sed -n "s/^[[:space:]]*$1=\"\([0-9]*\)\".*/\1/p" "$results" | head -n 1
}
[ -s "$results" ] || exit 1
tests=$(total_of tests)
failed=$(total_of failures)
passed=$((tests - failed - $(total_of disabled) - $(total_of skipped)))
[ "$passed" != 0 ] || [ "$failed" != 0 ] || failed=1 # no test is a failure too
exit "$code"
