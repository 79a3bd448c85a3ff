#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the fuzz targets (tests/fuzz) with Clang, libFuzzer, address and undefined-behavior sanitizers, and tries
# inputs until so many were tried in all, each target its share. Ends with the totals; exit code 1 where something was
# found, which is then in build/fuzz/findings. What was learned is kept in build/fuzz/corpus and used by the next run.
# Works from any folder.
#
#     deploy/fuzz.sh [EXECUTIONS [TARGET...]]     default: 1000000 over all targets; each takes its share of them
#     build/fuzz/tests/fuzz/formula_fuzz FILE     tries one input again
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
executions=${1:-1000000}
[[ $executions =~ ^[1-9][0-9]*$ ]] || { echo "usage: $0 [EXECUTIONS [TARGET...]]" >&2; exit 2; }
shift || true
build="$root/build/fuzz"
findings="$build/findings"

cd "$root"
deploy/install-packages.sh build test fuzz
cmake --preset fuzz >/dev/null
cmake --build --preset fuzz

# A finding of any sanitizer ends the run. An input of some kilobytes may take 20 s at most, and no single allocation of
# 256 MB. The entropic schedule would take three quarters of the time of targets with 100,000 features.
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1:suppressions=$root/tests/fuzz/ubsan_suppressions.txt
limits=(-entropic=0 -max_len=4096 -timeout=20 -rss_limit_mb=2048 -malloc_limit_mb=256)

fuzz() { # TARGET RUNS FOLDER...
  local target=$1 runs=$2
  shift 2
  mkdir -p "$build/corpus/$target" "$findings"
  "$build/tests/fuzz/${target}_fuzz" "${limits[@]}" -runs="$runs" -print_final_stats=1 \
    -artifact_prefix="$findings/$target-" \
    "$build/corpus/$target" "$@" >"$findings/$target.log" 2>&1
}

number() { # NAME TARGET
  sed -n "s/^stat::$1: *\([0-9]*\)$/\1/p" "$findings/$2.log"
}

total=0
found=()
printf '%-16s %12s %10s\n' target executions 'per second'
while read -r target share folders; do
  [ $# = 0 ] || [[ " $* " == *" $target "* ]] || continue
  # shellcheck disable=SC2086 # several folders
  fuzz "$target" $((executions * share / 100)) $folders || found+=("$target")
  tried=$(number number_of_executed_units "$target")
  total=$((total + ${tried:-0}))
  printf '%-16s %12s %10s\n' "$target" "${tried:-?}" "$(number average_exec_per_sec "$target")"
done <"$build/tests/fuzz/targets"

for target in "${found[@]}"; do
  what=$(grep --max-count=1 --extended-regexp 'ERROR:|runtime error|Broken promise|Assertion|SUMMARY' \
    "$findings/$target.log" || tail -n 1 "$findings/$target.log")
  printf '\n%s: %s\n' "$target" "$what"
  sed -n 's/.*Test unit written to/  input:/p' "$findings/$target.log"
  echo "  log: $findings/$target.log"
done
echo "$total executions, ${#found[@]} findings"
[ ${#found[@]} = 0 ]
