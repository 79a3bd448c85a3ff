#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the container image with podman and tries it as it is run: as nobody, with a root that cannot be written,
# without capabilities; its health check, a solve, a job that survives the container, a stop in good order. The last
# line is `N passed, N failed`. Needs root. Where no registry of images is reached, Debian's packages make the base
# image.
#
#     deploy/test-image.sh        the compiler's cache of this machine (ccache) makes it quick
set -euo pipefail
# shellcheck source=deploy/container-checks.sh
. "$(dirname "${BASH_SOURCE[0]}")/container-checks.sh"

name=dlcs-image-test-$$
alone=$name-alone
address=127.0.0.1:50961
most_megabytes=120

# shellcheck disable=SC2317 # finish() calls it
clean_up() {
  podman rm --force --ignore --volumes --time 1 "$name" "$alone"
  podman volume rm --force "$name"
}

is_small() {
  local megabytes=$(($(podman image inspect --format '{{.Size}}' "$image") / 1000000))
  echo "$megabytes MB"
  [ "$megabytes" -lt "$most_megabytes" ]
}

holds_nothing_else() {
  podman create --name "$name" "$image" && podman export "$name" | tar --list >"$work/files" &&
    podman rm --volumes "$name" &&
    grep usr/bin/dlcsd "$work/files" &&
    ! grep --extended-regexp 'bin/(sh|bash|dash|busybox|apt|dpkg|perl)$' "$work/files"
}

# As it is to be run.
run() { # OPTION...
  podman run --read-only --cap-drop all --security-opt no-new-privileges "$@"
}

start() {
  run --detach --network host --name "$name" --volume "$name:/var/lib/dlcs" "$image" \
    --listen "$address" --store /var/lib/dlcs/jobs.db --threads 1
}

takes_jobs() {
  within 30 podman exec "$name" /usr/bin/dlcs health --service dlcs.v1.JobService --server "$address"
}

# The image's own, on the address that is the default, which is free in a network without anybody else.
is_healthy_to_the_image() {
  run --detach --network none --name "$alone" "$image" && within 30 podman healthcheck run "$alone" &&
    podman rm --force --volumes --time 1 "$alone"
}

runs_as_nobody() {
  [ "$(podman inspect --format '{{.Config.User}}' "$name")" = 65532:65532 ] &&
    grep --quiet '^Uid:.*65532' "/proc/$(podman inspect --format '{{.State.Pid}}' "$name")/status"
}

solves() {
  dlcs solve /examples/rectifier.json --quiet --format json >"$work/solution" &&
    grep '"termination":"REACHED_END"' "$work/solution"
}

keeps_a_job() {
  job=$(dlcs submit /examples/rectifier.json) && dlcs watch "$job" &&
    dlcs result "$job" --format json >"$work/result"
}

stops_in_good_order() {
  podman stop --time 30 "$name" && [ "$(podman inspect --format '{{.State.ExitCode}}' "$name")" = 0 ] &&
    podman rm "$name"
}

finds_the_job_again() {
  start && takes_jobs && dlcs result "$job" --format json | cmp - "$work/result"
}

job=
deploy/install-packages.sh build containers
check "a base image" make_base
check "the image is built" build_image
check "it is below $most_megabytes MB" is_small
check "it holds no shell and no package manager" holds_nothing_else
check "its health check passes" is_healthy_to_the_image
check "it starts" start
check "it takes jobs" takes_jobs
check "it runs as nobody" runs_as_nobody
check "it solves" solves
check "it keeps a job" keeps_a_job
check "it stops in good order" stops_in_good_order
check "another container finds the job again" finds_the_job_again
failed=0
