#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Guards the contract in proto/: buf finds it well formed (proto/buf.yaml says by which rules), and nothing in it breaks
# programs that were written for what was released (proto/released.binpb) or, where the history is at hand, for any
# commit since.
#
#     deploy/check-proto.sh             exit code 0, or 1 with what is wrong
#     deploy/check-proto.sh --release   the same for the release alone; then makes this contract the released one
#     deploy/check-proto.sh FOLDER      another folder than proto/
#
# buf comes through npm (deploy/contract) into build/contract-tools, once. Exit code 77: it cannot be had here.
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# shellcheck source=deploy/npm-packages.sh
. "$root/deploy/npm-packages.sh"
checked="the contract"
tools="$root/build/contract-tools"
buf="$tools/node_modules/.bin/buf"
released="$root/proto/released.binpb"
release=
contract="$root/proto"
case "${1:-}" in
  --release) release=yes ;;
  -*) echo "usage: $0 [--release | FOLDER]" >&2 && exit 2 ;;
  ?*) contract=$1 ;;
esac

check_against() { # IMAGE_OR_FOLDER NAME
  "$buf" breaking "$contract" --against "$1" || { echo "The contract breaks programs written for $2." && exit 1; }
}

# Commits on the way from the release to here that touched the contract, as far as the clone has them.
check_against_history() {
  local since commit folder
  since=$(git -C "$root" log -1 --format=%H -- proto/released.binpb 2>/dev/null) || return 0 # no clone but a copy
  [ -n "$since" ] || return 0
  folder=$(mktemp -d)
  # shellcheck disable=SC2064 # this folder
  trap "rm -rf '$folder'" EXIT
  for commit in $(git -C "$root" rev-list "$since..HEAD" -- proto/dlcs); do
    mkdir "$folder/$commit"
    git -C "$root" archive "$commit" proto | tar --extract --directory "$folder/$commit"
    check_against "$folder/$commit/proto" \
      "commit ${commit:0:12}. Where what it added may go: deploy/check-proto.sh --release"
  done
}

install_npm_packages "$root/deploy/contract" "$tools" buf
"$buf" lint "$contract" || { echo "Rules: $root/proto/buf.yaml" && exit 1; }
check_against "$released" "the release (proto/released.binpb)"
[ -n "$release" ] || check_against_history
[ -z "$release" ] || "$buf" build "$contract" --exclude-source-info --output "$released"
