# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash disable=SC2154 # the script sets $checked
# For scripts that take tools from npm: source it.

# Says that nothing was checked and why, and ends the script with 77.
skip() { # WHY
  printf 'SKIPPED: %s was not checked. %s\n' "$checked" "$1" >&2
  exit 77
}

# Installs the packages of SOURCE/package-lock.json into TOOLS, once for each lock file; the script has said what it
# checks in $checked. Only what is missing on this machine is a reason to skip.
install_npm_packages() { # SOURCE TOOLS NAME
  local source=$1 tools=$2 name=$3 log="$2/npm.log"
  mkdir -p "$tools"
  cmp --silent "$source/package-lock.json" "$tools/package-lock.json" && [ -d "$tools/node_modules" ] && return
  command -v npm >/dev/null ||
    skip "There is no npm: install Node.js, or on Debian run deploy/install-packages.sh contract."
  cp "$source"/package*.json "$tools"
  (cd "$tools" && npm ci --ignore-scripts --fetch-retries=0 --fetch-timeout=30000 --loglevel=error) >"$log" 2>&1 &&
    return
  rm -f "$tools/package-lock.json"
  head -n 3 "$log" >&2
  local unreachable='code (E[45]|EAI_AGAIN|ECONN|EHOST|ENET|ENOTCACHED|ENOTFOUND|ETIMEDOUT|ERR_SOCKET)'
  grep --quiet --extended-regexp "$unreachable" "$log" &&
    skip "npm cannot get $name from $(npm config get registry 2>/dev/null)."
  exit 1
}
