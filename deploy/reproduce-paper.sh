#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Remakes figures 4.1 to 4.4, 4.6 to 4.8, 4.10 and Table 4.1 of [Wu & Chen] from our own output: pictures as SVG and
# PNG, their data, and README.md with what agrees with the paper and what does not. Works from any folder.
#
#     deploy/reproduce-paper.sh [OUT]        default: build/paper
#     CELLS=16 MESHES=8,16 deploy/reproduce-paper.sh     other meshes than 1/40 and 1/16 ... 1/256
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
out=$(realpath --canonicalize-missing "${1:-$root/build/paper}")
build="$root/build/release"

cd "$root"
deploy/install-packages.sh build test bench paper
cmake --preset release -DDLCS_BUILD_BENCHMARKS=ON >/dev/null
cmake --build --preset release --target dlcs iterates signorini_bench
mkdir -p "$out"
python3 deploy/figures/figures.py "$out" "$build" "${CELLS:-40}" "${MESHES:-16,32,40,64,128,256}"
echo "$out/README.md"
