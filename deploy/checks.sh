# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# What the scripts share that try something for real, check by check: sourced by them, in the top folder. Ends with
# `N passed, N failed`; the script sets `failed=0` after its last check, and defines clean_up() for what it started.
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
passed=0
failed=1 # until the last line

cd "$root"
work=$(mktemp -d)
chmod 755 "$work"
# shellcheck disable=SC2317 # the trap calls it
finish() {
  local code=$?
  trap - EXIT
  [ "$failed" = 0 ] || [ ! -s "$work/log" ] || tail -n 30 "$work/log" >&2
  clean_up >/dev/null 2>&1 || true
  rm -rf "$work"
  [ "$failed" = 0 ] || [ "$code" != 0 ] || code=1
  echo "$passed passed, $failed failed"
  exit "$code"
}
trap finish EXIT

check() { # WHAT COMMAND...    (a failure inside COMMAND does not end it: they are chains of &&)
  local what=$1
  shift
  "$@" >"$work/log" 2>&1 || { echo "FAILED: $what"; exit 1; }
  passed=$((passed + 1))
  echo "ok: $what"
}

# Tries COMMAND ten times a second until it succeeds, for SECONDS at most. The last attempt's output is what stays.
within() { # SECONDS COMMAND...
  local end=$((SECONDS + $1))
  shift
  until "$@" >"$work/attempt" 2>&1; do
    [ "$SECONDS" -lt "$end" ] || { cat "$work/attempt"; return 1; }
    sleep 0.1
  done
}
