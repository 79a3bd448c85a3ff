#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs web_clients_test.mjs with its packages, which npm puts into a folder of the build, once for each lock file.
# Usage: run.sh DLCSD PROTO_FOLDER BUILD_FOLDER. Exit code 77 where the packages cannot be had: nothing was tested then.
set -euo pipefail
source_folder="$(cd "$(dirname "$0")" && pwd)"
dlcsd="$1" proto="$2" build="$3"

skip() {
  echo "$1"
  exit 77
}

command -v npm >/dev/null || skip "There is no npm: install Node.js, or on Debian run deploy/install-packages.sh test."
mkdir -p "$build"
cp "$source_folder/web_clients_test.mjs" "$source_folder/package.json" "$build"
if ! cmp -s "$source_folder/package-lock.json" "$build/installed-lock.json"; then
  cp "$source_folder/package-lock.json" "$build"
  (cd "$build" && npm ci --ignore-scripts --fetch-retries=0 --fetch-timeout=30000 --loglevel=error) \
      >"$build/npm.log" 2>&1 || skip "npm cannot get the clients: $(tail -n 1 "$build/npm.log")"
  cp "$build/package-lock.json" "$build/installed-lock.json"
fi
cd "$build"
DLCSD="$dlcsd" DESCRIPTORS="$proto/released.binpb" exec node --test web_clients_test.mjs
