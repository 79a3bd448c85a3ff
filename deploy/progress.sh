# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# To be sourced.

# Shows how far a command is, of which it reads a line a step: the newest line in place on a terminal, and elsewhere, as
# in a log, one line every half minute.
show_progress() {
  local line newest='' shown=$SECONDS code
  while true; do
    code=0
    IFS= read -r -t 5 line || code=$?
    if [ "$code" = 0 ]; then
      newest=$line
      [ ! -t 1 ] || printf '\r\033[K%.*s' "$(($(tput cols 2>/dev/null || echo 80) - 1))" "$newest"
    elif [ "$code" -le 128 ]; then # the end; above, nothing came for 5 seconds
      break
    fi
    if [ ! -t 1 ] && [ -n "$newest" ] && [ $((SECONDS - shown)) -ge 30 ]; then
      printf '%s\n' "$newest"
      shown=$SECONDS
    fi
  done
  [ ! -t 1 ] || printf '\r\033[K'
}
