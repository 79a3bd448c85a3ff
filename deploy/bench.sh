#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds and runs the benchmarks and writes a Markdown report: machine, commit, commands, tables, and every answer that
# failed its check; beside it REPORT-results with the results as JSON. Works from any folder; keep the machine quiet.
#
#     deploy/bench.sh [--quick] [REPORT]     default: build/bench-report.md; --quick: ten minutes instead of an hour
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
quick=()
if [ "${1:-}" = --quick ]; then
  quick=(--quick)
  shift
fi
report=$(realpath --canonicalize-missing "${1:-$root/build/bench-report.md}")
[ "$report" != "${report%.md}" ] || report+=.md
# Those that check their answers and know --quick.
programs=(work_precision_bench choice_bench signorini_bench growth_bench threads_bench service_bench
  periodic_bench)
plain=(events_bench lcp_bench)
[ ${#quick[@]} -gt 0 ] || plain+=(large_bench)

cd "$root"
deploy/install-packages.sh build test bench
cmake --preset release -DDLCS_BUILD_BENCHMARKS=ON >/dev/null
cmake --build --preset release --target "${programs[@]}" "${plain[@]}"

results="${report%.md}-results" # kept: report.py makes the report from it again
mkdir -p "$results"
rm -f "$results"/*_bench.json

run() { # PROGRAM OPTION...
  local program=$1
  shift
  echo "$program $*"
  "build/release/tests/bench/$program" --benchmark_out="$results/$program.json" --benchmark_out_format=json "$@" \
    >/dev/null 2>"$results/$program.log" || { cat "$results/$program.log" >&2; true; }
}

commit=$(git describe --always --dirty --abbrev=12 2>/dev/null || echo unknown)
processor=$(sed -n 's/^model name.*: //p' /proc/cpuinfo | head -n 1)
memory=$(awk '/MemTotal/ {printf "%.0f GB", $2 / 1e6}' /proc/meminfo)
cat >"$results/machine.md" <<END
# Benchmarks of dlcs

| | |
| --- | --- |
| commit | $commit |
| date | $(date --utc --iso-8601=minutes) |
| machine | $(nproc) processors, $processor, $memory |
| system | $(sed -n 's/^PRETTY_NAME="\(.*\)"/\1/p' /etc/os-release), $(c++ --version | head -n 1) |
| load when it began | $(cut -d' ' -f1-3 /proc/loadavg) |
| command | deploy/bench.sh ${quick[*]} |
| singly | build/release/tests/bench/PROGRAM ${quick[*]} |
END
if [ ${#quick[@]} -gt 0 ]; then
  cat >>"$results/machine.md" <<'END'

Left out by `--quick`: the mesh 1/512, most steps of implicit Euler by Cholesky from 1/128 on (extrapolated), the
largest sizes of the growth, errors that take a method longer than half a second, and `large_bench` (m = 199,809, n =
2,000).
END
fi

for program in "${programs[@]}"; do run "$program" "${quick[@]}"; done
for program in "${plain[@]}"; do run "$program" "${quick[@]/--quick/--benchmark_min_time=0.02}"; done

code=0
python3 tests/bench/report.py "$results" >"$report" || code=$?
echo "$report"
exit "$code"
