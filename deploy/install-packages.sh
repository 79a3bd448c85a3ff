#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs the Debian packages of the given lists that are missing; says nothing when none is.
#
#     deploy/install-packages.sh build        what building and running takes
#     deploy/install-packages.sh build test   and the tests
#
# Needs root or sudo, and only when something is missing.
set -euo pipefail

lists="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/packages"
[ $# -gt 0 ] || { echo "usage: $0 LIST... (of: $(cd "$lists" && echo *.txt | sed 's/\.txt//g'))" >&2; exit 2; }

packages_of() { # LIST
  [ -f "$lists/$1.txt" ] || { echo "$0: there is no list $lists/$1.txt" >&2; exit 2; }
  sed 's/#.*//' "$lists/$1.txt"
}

is_installed() { # PACKAGE
  [ "$(dpkg-query --show --showformat '${db:Status-Status}' "$1" 2>/dev/null)" = installed ]
}

as_root() {
  if [ "$(id -u)" = 0 ]; then
    "$@"
  elif command -v sudo >/dev/null; then
    sudo "$@"
  else
    echo "$0: missing packages: ${missing[*]}. Run it as root, or install sudo." >&2
    exit 1
  fi
}

missing=()
for list in "$@"; do
  for package in $(packages_of "$list"); do
    is_installed "$package" || missing+=("$package")
  done
done
[ ${#missing[@]} -gt 0 ] || exit 0

echo "Installing ${#missing[@]} Debian packages: ${missing[*]}"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt=(env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=300 -o Dpkg::Use-Pty=0)
if ! { as_root "${apt[@]}" update &&
  as_root "${apt[@]}" install --no-install-recommends "${missing[@]}"; } >"$log" 2>&1; then
  cat "$log" >&2
  echo "$0: could not install ${missing[*]}; see above." >&2
  exit 1
fi
