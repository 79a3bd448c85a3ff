#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs a test of this folder, or another program by its path, with the packages of this folder, which npm puts into a
# folder of the build, once for each lock file. Usage: run.sh PROGRAM.mjs BUILD_FOLDER [ARGUMENT...], with the variables
# that the program names. Exit code 77 where the packages cannot be had: nothing was tested then.
set -euo pipefail
source_folder="$(cd "$(dirname "$0")" && pwd)"
program="$1" build="$2"
shift 2

skip() {
  echo "$1"
  exit 77
}

command -v npm >/dev/null || skip "There is no npm: install Node.js, or on Debian run deploy/install-packages.sh test."
if [ "${program##*/}" != web_clients_test.mjs ]; then
  [ -x /usr/bin/chromium ] || skip "There is no Chromium: on Debian run deploy/install-packages.sh test."
fi
mkdir -p "$build"
exec 9>"$build/lock"
flock 9 # two tests share the packages
cp "$source_folder"/*.mjs "$source_folder/package.json" "$build"
[ "$program" = "${program##*/}" ] || cp "$program" "$build"
if ! cmp -s "$source_folder/package-lock.json" "$build/installed-lock.json"; then
  cp "$source_folder/package-lock.json" "$build"
  (cd "$build" && npm ci --ignore-scripts --fetch-retries=1 --fetch-timeout=30000 --loglevel=error) \
    >"$build/npm.log" 2>&1 9>&- || skip "npm cannot get the packages: $(tail -n 1 "$build/npm.log")"
  cp "$build/package-lock.json" "$build/installed-lock.json"
fi
exec 9>&-
cd "$build"
case "$program" in
  *_test.mjs) exec node --test --test-reporter=spec "$program" ;;
  *) exec node "${program##*/}" "$@" ;;
esac
