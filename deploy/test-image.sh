#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the container image with podman and tries it as it is run: as nobody, with a root that cannot be written, without
# capabilities; its health check, a solve, a job that survives the container, a stop in good order. The last line is `N passed,
# N failed`. Needs root. Where no registry of images is reached, Debian's packages make the base image.
#
#     deploy/test-image.sh        the compiler's cache of this machine (ccache) makes it quick
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
image=localhost/dlcs:test
base=docker.io/library/debian:bookworm-slim
name=dlcs-image-test-$$
address=127.0.0.1:50961
most_megabytes=120
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
  podman rm --force --ignore --time 1 "$name" >/dev/null 2>&1 || true
  podman volume rm --force "$name" >/dev/null 2>&1 || true
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

make_base() {
  podman image exists "$base" || podman pull --quiet "$base" 2>/dev/null ||
    { mmdebstrap --quiet --variant=minbase bookworm "$work/base.tar" && podman import --quiet "$work/base.tar" "$base"; }
}

build_image() {
  local cache
  cache=$(ccache --get-config cache_dir)
  mkdir -p "$cache"
  podman build --runtime runc --network host --file deploy/Dockerfile --tag "$image" --build-arg BASE="$base" \
    --volume "$cache:/host-ccache" --build-arg CCACHE_DIR=/host-ccache --build-arg CMAKE_OPTIONS="${CMAKE_OPTIONS:-}" .
}

is_small() {
  local megabytes=$(($(podman image inspect --format '{{.Size}}' "$image") / 1000000))
  echo "$megabytes MB"
  [ "$megabytes" -lt "$most_megabytes" ]
}

holds_nothing_else() {
  podman create --name "$name" "$image" && podman export "$name" | tar --list >"$work/files" && podman rm "$name" &&
    grep usr/bin/dlcsd "$work/files" && ! grep --extended-regexp 'bin/(sh|bash|dash|busybox|apt|dpkg|perl)$' "$work/files"
}

# As it is to be run. The limits are named since not every machine lets a container raise them.
run() { # OPTION...
  podman run --runtime runc --network host --read-only --cap-drop all --security-opt no-new-privileges \
    --ulimit nofile=4096:4096 --ulimit nproc=4096:4096 "$@"
}

start() {
  run --detach --name "$name" --volume "$name:/var/lib/dlcs" "$image" \
    --listen "$address" --store /var/lib/dlcs/jobs.db --threads 1
}

is_healthy() {
  for _ in $(seq 100); do
    podman exec "$name" /usr/bin/dlcs capabilities --server "$address" && return
    sleep 0.1
  done
  podman logs "$name"
  return 1
}

runs_as_nobody() {
  [ "$(podman inspect --format '{{.Config.User}}' "$name")" = 65532:65532 ] &&
    grep --quiet '^Uid:.*65532' "/proc/$(podman inspect --format '{{.State.Pid}}' "$name")/status"
}

# dlcs from the image, on the problems of this folder.
dlcs() { # COMMAND ARGUMENT...
  run --rm --volume "$root/deploy/examples:/examples:ro" --entrypoint /usr/bin/dlcs "$image" "$@" --server "$address"
}

solves() {
  dlcs solve /examples/rectifier.json --quiet --format json >"$work/solution" &&
    grep '"termination": "CONVERGED"' "$work/solution"
}

keeps_a_job() {
  job=$(dlcs submit /examples/rectifier.json) && dlcs watch "$job" &&
    dlcs result "$job" --format json >"$work/result"
}

stops_in_good_order() {
  podman stop --time 30 "$name" && [ "$(podman inspect --format '{{.State.ExitCode}}' "$name")" = 0 ] && podman rm "$name"
}

finds_the_job_again() {
  start && is_healthy && dlcs result "$job" --format json | cmp - "$work/result"
}

job=
deploy/install-packages.sh build containers
check "a base image" make_base
check "the image is built" build_image
check "it is below $most_megabytes MB" is_small
check "it holds no shell and no package manager" holds_nothing_else
check "it starts" start
check "it is healthy" is_healthy
check "it runs as nobody" runs_as_nobody
check "it solves" solves
check "it keeps a job" keeps_a_job
check "it stops in good order" stops_in_good_order
check "another container finds the job again" finds_the_job_again
failed=0
