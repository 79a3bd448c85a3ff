#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs the Debian packages of the given lists that are missing; prints nothing if none is. In a list, "PACKAGE
# unless COMMAND" requires PACKAGE only if COMMAND is not found, since it may come from elsewhere. "@LIST" includes
# another list.
#
#     deploy/install-packages.sh engine       what building the engine takes
#     deploy/install-packages.sh build        what building and running everything takes
#     deploy/install-packages.sh build test   and the tests
#
# Needs root or sudo, and only when something is missing.
set -euo pipefail

here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
lists="$here/packages"
# shellcheck source-path=SCRIPTDIR source=progress.sh
source "$here/progress.sh"
[ $# -gt 0 ] || { echo "usage: $0 LIST... (of: $(cd "$lists" && echo *.txt | sed 's/\.txt//g'))" >&2; exit 2; }

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

lines_of() { # LIST
  local first rest
  while read -r first rest; do
    case $first in
      '') ;;
      @*) lines_of "${first#@}" ;;
      *) echo "$first $rest" ;;
    esac
  done < <(sed 's/#.*//' "$lists/$1.txt")
}

missing=()
for list in "$@"; do
  [ -f "$lists/$list.txt" ] || { echo "$0: there is no list $lists/$list.txt" >&2; exit 2; }
  while read -r package unless command; do
    is_installed "$package" || { [ "$unless" = unless ] && command -v "$command" >/dev/null; } || missing+=("$package")
  done < <(lines_of "$list")
done
[ ${#missing[@]} -gt 0 ] || exit 0

echo "Installing ${#missing[@]} Debian packages: ${missing[*]}"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# On descriptor 3 apt reports "dlstatus:3:12.5:Retrieving file 3 of 80" and "pmstatus:cmake:40.1:Unpacking cmake".
apt=(env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=300 -o Dpkg::Use-Pty=0 -o APT::Status-Fd=3)
if ! { as_root "${apt[@]}" update && as_root "${apt[@]}" install --no-install-recommends "${missing[@]}"; } \
  3>&1 >"$log" 2>&1 | sed --unbuffered --quiet 's/^..status:[^:]*:\([0-9]*\)[^:]*:\(.*\)/[\1 %] \2/p' |
  show_progress; then
  cat "$log" >&2
  echo "$0: could not install ${missing[*]}; see above." >&2
  exit 1
fi
