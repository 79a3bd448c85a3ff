#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What the unity builds of the other presets cannot see: compiles each file by itself (preset dev, warnings are errors),
# and then each header of the project, so that every file includes what it uses. Works from any folder.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
deploy/install-packages.sh build test mpi
cmake --preset dev >/dev/null
cmake --build --preset dev
exec /usr/bin/python3 tests/headers_alone.py build/dev
