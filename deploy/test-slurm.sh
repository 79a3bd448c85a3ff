#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs workers under a real Slurm: its controller, two nodes, PostgreSQL and a front on this machine, in namespaces of
# their own. The script of `dlcs workers slurm` is submitted as it is. Workers share jobs, give a job back when Slurm
# cancels them, and end when there is nothing to do. The last line is `N passed, N failed`. Needs root.
#
#     deploy/test-slurm.sh [BUILD]    the folder of a build with dlcs and dlcsd (build/release, which is made)
set -euo pipefail
build=${1:-}

if [ "${IN_NAMESPACE:-}" != yes ]; then
  root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
  cd "$root"
  deploy/install-packages.sh build test slurm
  if [ -z "$build" ]; then
    build=build/release
    cmake --preset release >/dev/null && cmake --build --preset release --target dlcs dlcsd
  fi
  build=$(realpath "$build")
  # All processes end with the first one.
  IN_NAMESPACE=yes exec unshare --net --mount --pid --fork --kill-child --mount-proc "$0" "$build"
fi

# shellcheck source=deploy/checks.sh
. "$(dirname "${BASH_SOURCE[0]}")/checks.sh"

host=10.77.0.1
front=127.0.0.1:50951
store=postgresql://postgres@$host/postgres
export PATH=$build/client:$build/server:$PATH DLCS_SERVER=$front

# shellcheck disable=SC2317 # finish() calls it
clean_up() {
  [ "$failed" = 0 ] || tail -n 20 "$work"/slurm/*.log "$work"/*.out >&2
}

has_an_address() {
  ip link set lo up && ip address add $host/32 dev lo
}

starts_postgresql() {
  local programs
  programs=$(pg_config --bindir) || return
  install --directory --owner postgres "$work/postgresql" &&
    run_as_postgres "$programs/initdb" --pgdata "$work/postgresql/data" --username postgres --auth trust --no-sync &&
    echo "host all all $host/32 trust" >>"$work/postgresql/data/pg_hba.conf" || return
  run_as_postgres "$programs/postgres" -D "$work/postgresql/data" -c listen_addresses=$host \
    -c unix_socket_directories="$work/postgresql" -c fsync=off >"$work/postgresql.out" 2>&1 &
}

run_as_postgres() {
  (cd / && setpriv --reuid postgres --regid postgres --clear-groups "$@")
}

starts_a_front() {
  dlcsd --role front --store "$store" --listen $front --threads 1 >"$work/front.out" 2>&1 &
}

# Two nodes on one machine differ in their ports. There is no munge, and nothing that needs cgroups.
configure_slurm() {
  mkdir -p "$work/slurm/state" "$work/slurm/spool.n1" "$work/slurm/spool.n2" || return
  cat >"$work/slurm/slurm.conf" <<CONFIGURATION
ClusterName=dlcs
SlurmctldHost=localhost($host)
SlurmUser=root
SlurmdUser=root
AuthType=auth/none
CredType=cred/none
SlurmctldPort=16817
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
SelectType=select/cons_tres
ReturnToService=2
SlurmctldPidFile=$work/slurm/controller.pid
SlurmdPidFile=$work/slurm/%n.pid
SlurmdSpoolDir=$work/slurm/spool.%n
StateSaveLocation=$work/slurm/state
SlurmctldLogFile=$work/slurm/controller.log
SlurmdLogFile=$work/slurm/%n.log
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
KillWait=30
NodeName=n1 NodeHostname=localhost NodeAddr=$host Port=17001 CPUs=1 RealMemory=1000
NodeName=n2 NodeHostname=localhost NodeAddr=$host Port=17002 CPUs=1 RealMemory=1000
PartitionName=lab Nodes=n1,n2 Default=YES MaxTime=10 State=UP OverSubscribe=NO
CONFIGURATION
  export SLURM_CONF="$work/slurm/slurm.conf"
  slurmctld -D >"$work/controller.out" 2>&1 &
  slurmd -D -N n1 >"$work/n1.out" 2>&1 &
  slurmd -D -N n2 >"$work/n2.out" 2>&1 &
}

nodes_are_idle() {
  [ "$(sinfo --noheader --format %A)" = 0/2 ]
}

# Prints the number of the array.
submits_workers() { # IDLE
  dlcs workers slurm --store "$store" --count 2 --cpus 1 --memory 500MB --time-limit 5m --partition lab \
    --exit-when-idle "$1" --program "$build/server/dlcsd" --output "$work/workers.sh" &&
    array=$(sbatch --parsable --output "$work/worker-%a.out" "$work/workers.sh")
}

are_in_state() { # STATE
  local states
  states=$(scontrol --oneliner show job "$array" | sed 's/.* JobState=\([A-Z]*\) .*/\1/')
  [ "$states" = "$1"$'\n'"$1" ]
}

have_exit_code_0() {
  [ "$(scontrol --oneliner show job "$array" | grep --count ' ExitCode=0:0 ')" = 2 ]
}

solves_many() {
  local jobs=() one
  for _ in $(seq 12); do
    jobs+=("$(dlcs submit deploy/examples/rectifier.json --method time-stepping --steps 300000 --at 1,2)") || return
  done
  for one in "${jobs[@]}"; do dlcs watch --quiet "$one" || return; done
}

both_have_worked() {
  grep --quiet 'job finished' "$work/worker-1.out" && grep --quiet 'job finished' "$work/worker-2.out"
}

# shellcheck disable=SC2054 # --at takes a list
long_solve=(deploy/examples/rectifier.json --method time-stepping --steps 15000000 --at 1,2)

query() { # SQL
  psql --host $host --username postgres --tuples-only --no-align --command "$1" postgres | grep .
}

worker_of_job() {
  query "SELECT worker FROM jobs WHERE state = 2 AND progress > 0 AND id = '${job#jobs/}'"
}

is_cancelled_with_a_job() {
  job=$(dlcs submit "${long_solve[@]}") && within 60 worker_of_job && cancelled=$(worker_of_job) || return
  task=${cancelled##*-}
  [ "$cancelled" = "slurm-$array-$task" ] && scancel "${array}_$task"
}

# Given back at once: a lease lasts for half a minute.
is_elsewhere() {
  local worker
  worker=$(worker_of_job) && [ "$worker" = "slurm-$array-$((3 - task))" ]
}

ended_in_good_order() {
  grep --quiet 'shut down$' "$work/worker-$task.out"
}

ends_with_the_same_bits() {
  dlcs watch --quiet "$job" && dlcs result "$job" --format csv >"$work/result" &&
    dlcs solve --local "${long_solve[@]}" --format csv --quiet | cmp - "$work/result"
}

job=
task=
cancelled=
array=
check "there is an address" has_an_address
check "PostgreSQL starts" starts_postgresql
check "PostgreSQL answers" within 30 query "SELECT 1"
check "a front starts" starts_a_front
check "the front answers" within 30 dlcs health --service dlcs.v1.JobService
check "Slurm starts" configure_slurm
check "its two nodes are idle" within 30 nodes_are_idle
check "it takes the script" submits_workers 8s
check "two workers run" within 30 are_in_state RUNNING
check "they solve many jobs" solves_many
check "both have worked" both_have_worked
check "they end when there is nothing to do" within 60 are_in_state COMPLETED
check "with exit code 0" have_exit_code_0
check "it takes the script again" submits_workers 30s
check "two workers run again" within 30 are_in_state RUNNING
check "a worker that has a job is cancelled" is_cancelled_with_a_job
check "the other continues the job" within 15 is_elsewhere
check "the first ended in good order" within 15 ended_in_good_order
check "the job ends with the bits of a solve that nobody disturbed" ends_with_the_same_bits
failed=0
