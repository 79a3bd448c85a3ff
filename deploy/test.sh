#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds everything and runs every test. The last line is `N passed, N failed`; a
# build that fails counts as one failure, and a test that was skipped is named before it. Works from any folder.
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

log="$root/build/$preset/ctest.log"
code=0
ctest --preset "$preset" --parallel 2 --no-tests=error 2>&1 | tee "$log" || code=$?

# "99% tests passed, 1 tests failed out of 100"; it counts what could not be run among the failures.
read -r broken tests < <(sed -n 's/^[0-9]*% tests passed, \([0-9]*\) tests failed out of \([0-9]*\)$/\1 \2/p' "$log") ||
  exit 1 # no test is a failure too
mapfile -t skipped < <(sed -n 's/^ *[0-9]*\/[0-9]* *Test *#[0-9]*: \([^ ]*\) .*\*\*\*Skipped.*/\1/p' "$log")
[ ${#skipped[@]} = 0 ] || echo "SKIPPED: ${skipped[*]} (to see why: ctest --preset $preset -V -R '^NAME\$')"
failed=$broken
# What failed once more, at the end, where it is found in a long log.
awk '/^ *[0-9]+\/[0-9]+ Test / { if (count) show(); count = 0; taking = /\*\*\*/ && !/\*\*\*Skipped/ }
     /^ *Start +[0-9]+: / { next }
     /^$/ && !count { next }
     /^[0-9]+% tests passed/ { exit }
     taking { lines[++count] = $0 }
     function show(  k) { for (k = count > 60 ? count - 59 : 1; k <= count; ++k) print lines[k]; print "" }
     END { if (count) show() }' "$log"
passed=$((tests - failed - ${#skipped[@]}))
exit "$code"
