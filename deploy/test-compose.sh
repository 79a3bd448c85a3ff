#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs compose.yaml as it stands, with docker-compose on podman: PostgreSQL, a front and two workers. A job is followed
# to its end while its worker is killed, and has the bits of a solve that nobody disturbed. The last line is `N passed,
# N failed`. Needs root.
#
# Where no registry of images is reached, Debian's packages make the base image, and one that stands in for postgres:15:
# the same server, with an entry point that knows POSTGRES_USER and POSTGRES_PASSWORD and nothing else of the official
# one.
#
#     deploy/test-compose.sh        the compiler's cache of this machine (ccache) makes it quick
set -euo pipefail
# shellcheck source=deploy/container-checks.sh
. "$(dirname "${BASH_SOURCE[0]}")/container-checks.sh"

project=dlcs-compose-test-$$
postgres=docker.io/library/postgres:15
stands_in= # where the image above is ours
address=127.0.0.1:50962
metrics=127.0.0.1:50963

export DLCS_DATABASE_PASSWORD=of-this-test DLCS_PORT=${address#*:} DLCS_METRICS_PORT=${metrics#*:}
export DOCKER_HOST="unix://$work/podman.sock"

compose() {
  docker-compose --project-name "$project" --file deploy/compose.yaml "$@"
}

# shellcheck disable=SC2317 # finish() calls it
clean_up() {
  [ "$failed" = 0 ] || compose logs --tail 20 >&2
  compose down --volumes --timeout 1
  kill "${helpers[@]}"
  podman untag "$image" docker.io/library/dlcs
  [ -z "$stands_in" ] || podman rmi "$postgres"
}

make_postgres() {
  if podman image exists "$postgres" || podman pull --quiet "$postgres"; then return; fi
  stands_in=yes
  mkdir "$work/postgres"
  cat >"$work/postgres/entrypoint" <<'ENTRYPOINT'
#!/bin/sh
set -e
if [ ! -s "$PGDATA/PG_VERSION" ]; then
  printf %s "$POSTGRES_PASSWORD" >/tmp/password
  initdb --username "$POSTGRES_USER" --pwfile /tmp/password --auth-host scram-sha-256 --encoding UTF8
  rm /tmp/password
  echo "host all all all scram-sha-256" >>"$PGDATA/pg_hba.conf"
  echo "CREATE DATABASE \"$POSTGRES_USER\"" | postgres --single -j postgres
fi
exec postgres -c listen_addresses=*
ENTRYPOINT
  chmod 755 "$work/postgres/entrypoint"
  cat >"$work/postgres/Dockerfile" <<DOCKERFILE
FROM $base
RUN apt-get -qq update && apt-get -qq install --no-install-recommends postgresql-15 && \
    rm -rf /var/lib/postgresql/15 && \
    install --directory --owner postgres --mode 700 /var/lib/postgresql/data
COPY entrypoint /
ENV PATH=/usr/lib/postgresql/15/bin:/usr/bin:/bin PGDATA=/var/lib/postgresql/data LANG=C.UTF-8
VOLUME /var/lib/postgresql/data
USER postgres
ENTRYPOINT ["/entrypoint"]
DOCKERFILE
  podman build --format docker --network host --tag "$postgres" "$work/postgres"
}

containers() { # SERVICE
  podman ps --quiet --filter "label=com.docker.compose.project=$project" --filter "label=com.docker.compose.service=$1"
}

# Podman has systemd ask for the health of containers; not every machine that runs this has one.
ask_for_health() {
  while sleep 2; do
    for container in $(podman ps --quiet --filter "label=com.docker.compose.project=$project"); do
      podman healthcheck run "$container" || true # not yet
    done
  done
}

starts() {
  podman tag "$image" docker.io/library/dlcs && compose up --detach --no-build
}

runs_two_workers() {
  [ "$(containers front | wc -l)" = 1 ] && [ "$(containers worker | wc -l)" = 2 ]
}

are_healthy() {
  local container
  for container in $(containers front) $(containers worker); do
    [ "$(podman inspect --format '{{.State.Health.Status}}' "$container")" = healthy ] || return 1
  done
}

has_a_front_for() { # PAGE
  curl --silent --show-error --fail "http://$metrics$1"
}

# On a machine with other work the start of a solve is sometimes slow, but a job of minutes is not over before it is
# found.
# shellcheck disable=SC2054 # --at takes a list
long_solve=(/examples/rectifier.json --method time-stepping --steps 15000000 --at 1,2)

worker_of_job() {
  podman exec "$(containers postgresql)" psql --username dlcs --tuples-only --no-align \
    --command "SELECT worker FROM jobs WHERE state = 2 AND id = '${job#jobs/}'" | grep .
}

loses_its_worker() {
  job=$(dlcs submit "${long_solve[@]}") && within 60 worker_of_job || return
  killed=$(worker_of_job) || return
  killed=${killed%:*} # its name is the container's, and a port
  podman kill --signal KILL "$killed"
}

# As soon as it has not renewed its lease for --lease-ms.
is_elsewhere() {
  local worker
  worker=$(worker_of_job) && [ "$worker" != "$killed:50051" ]
}

ends_with_the_same_bits() {
  dlcs watch --quiet "$job" && dlcs result "$job" --format csv >"$work/result" &&
    podman run --rm --network none --volume "$root/deploy/examples:/examples:ro" --entrypoint /usr/bin/dlcs "$image" \
      solve "${long_solve[@]}" --format csv --quiet | cmp - "$work/result"
}

has_all_jobs_of_many() {
  local jobs=() one
  for _ in 1 2 3 4 5 6; do jobs+=("$(dlcs submit /examples/rectifier.json)") || return; done
  for one in "${jobs[@]}"; do dlcs watch --quiet "$one" || return; done
}

stops() {
  local front
  compose stop --timeout 30 &&
    front=$(podman ps --all --quiet --filter "label=com.docker.compose.project=$project" \
      --filter label=com.docker.compose.service=front) &&
    [ "$(podman inspect --format '{{.State.ExitCode}}' "$front")" = 0 ]
}

job=
killed=
helpers=()
deploy/install-packages.sh build containers compose
check "a base image" make_base
check "the image is built" build_image
check "an image of PostgreSQL" make_postgres
podman system service --time 0 "$DOCKER_HOST" >"$work/service" 2>&1 &
helpers+=($!)
ask_for_health >"$work/health" 2>&1 &
helpers+=($!)
check "podman answers as Docker does" within 30 test -S "$work/podman.sock"
check "all of it starts" starts
check "there are a front and two workers" runs_two_workers
check "they are healthy" within 60 are_healthy
check "the front is ready" within 60 has_a_front_for /readyz
check "the front is ready for jobs" within 60 has_a_front_for /readyz/jobs
check "it solves many jobs" has_all_jobs_of_many
check "a job loses its worker" loses_its_worker
check "the other worker continues it" within 120 is_elsewhere
check "it ends with the bits of a solve that nobody disturbed" ends_with_the_same_bits
check "the front is still ready" has_a_front_for /readyz/jobs
check "it stops in good order" stops
failed=0
