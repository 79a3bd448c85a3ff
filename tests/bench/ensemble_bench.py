#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""An ensemble of rectifiers as a job on four workers, two of which are killed on the way, beside four engines at once.

Usage: ensemble_bench.py DLCS DLCSD [MEMBERS] [--no-kills]

MEMBERS (1,000,000) rectifiers that start at different voltages. First four processes `dlcs ensemble --threads 1`, each
with a quarter of them, at the same time: what the engine can do. Then one job on a front and four workers with one
thread each, which share a PostgreSQL that really writes; two workers are killed with kill -9 when a fifth and two
fifths are stored, and started again. The time of the job is that from before the job is created until all results are
in a file. It fails where a member is missing, comes twice or does not have the bits of the engine, and prints the
throughputs, their ratio, and the processor time of each side.
"""

import csv
import json
import os
import pathlib
import resource
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "e2e"))
from database import Database  # noqa: E402

PROJECT = pathlib.Path(__file__).parents[2]
PROBLEM = PROJECT / "deploy/examples/rectifier.json"
WORKERS = 4
HORIZON = "2"
KILL_AT = (0.2, 0.4)  # of the members
LEASE_MS = "3000"


def write_members(path, begin, end, members):
    with open(path, "w") as file:
        file.write("x1\n")
        file.writelines(f"{9 * k / members!r}\n" for k in range(begin, end))


def processor_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run_engines(dlcs, folder, members):
    """The bits of x at the end of each member, and the seconds that four engines took."""
    parts = []
    for k in range(WORKERS):
        begin, end = k * members // WORKERS, (k + 1) * members // WORKERS
        write_members(folder / f"part{k}.csv", begin, end, members)
        parts.append((begin, folder / f"solved{k}.csv"))
    start = time.monotonic()
    engines = [
        subprocess.Popen(
            [dlcs, "ensemble", PROBLEM, folder / f"part{k}.csv", "--threads", "1", "--at", HORIZON]
            + ["--deadline", "100000", "--format", "csv", "--output", parts[k][1], "--quiet"]
        )
        for k in range(WORKERS)
    ]
    for engine in engines:
        if engine.wait() != 0:
            sys.exit(f"an engine ended with {engine.returncode}")
    seconds = time.monotonic() - start
    ends = {}
    for begin, path in parts:
        with open(path) as file:
            for row in csv.DictReader(file):
                ends[begin + int(row["member"])] = row["x1"]
    return ends, seconds


class Fleet:
    """A front and four workers."""

    def __init__(self, dlcsd, store):
        self.dlcsd, self.store = dlcsd, store
        self.servers = {}
        self.address = self.start("front")
        for k in range(WORKERS):
            self.start(f"worker{k}")

    def start(self, name):
        role = "front" if name == "front" else "worker"
        server = subprocess.Popen(
            [self.dlcsd, "--store", self.store, "--role", role, "--worker-name", name, "--threads", "1"]
            + ["--listen", "127.0.0.1:0", "--lease-ms", LEASE_MS, "--log-level", "warn"],
            stdout=subprocess.PIPE,
            text=True,
        )
        self.servers[name] = server
        return server.stdout.readline().split()[-1]

    def kill(self, name):
        self.servers[name].send_signal(signal.SIGKILL)
        self.servers[name].wait()

    def stop(self):
        for server in self.servers.values():
            server.terminate()
        for server in self.servers.values():
            server.wait()


def run_job(dlcs, fleet, folder, members, kills):
    """The path of the results, and the seconds that the job took."""
    write_members(folder / "members.csv", 0, members, members)
    server = ["--server", fleet.address]
    start = time.monotonic()
    name = subprocess.run(
        [dlcs, "ensemble", PROBLEM, folder / "members.csv", "--detach", *server],
        check=True,
        capture_output=True,
        text=True,
    ).stdout.strip()
    created = time.monotonic() - start
    results = folder / "results.csv"
    reader = subprocess.Popen(
        [dlcs, "result", name, *server, "--patience", "100000", "--format", "csv", "--output", results]
    )
    to_kill = list(zip(KILL_AT, ("worker0", "worker1"))) if kills else []
    killed = []
    while reader.poll() is None:
        time.sleep(0.2)
        if not to_kill and not killed:
            continue
        job = json.loads(
            subprocess.run([dlcs, "get", name, *server, "--format", "json"], check=True, capture_output=True).stdout
        )
        if to_kill and job.get("progress", 0) >= to_kill[0][0]:
            victim = to_kill.pop(0)[1]
            fleet.kill(victim)
            killed.append((time.monotonic() + 2, victim))
        if killed and killed[0][0] <= time.monotonic():
            fleet.start(killed.pop(0)[1])
    seconds = time.monotonic() - start
    if reader.returncode != 0:
        sys.exit(f"dlcs result ended with {reader.returncode}")
    for _, victim in killed:
        fleet.start(victim)
    if to_kill:
        print(f"the job was over before {to_kill[0][1]} was killed")
    return results, seconds, created


def check(results, ends):
    seen = set()
    with open(results) as file:
        for row in csv.DictReader(file):
            member = int(row["member"])
            if member in seen:
                sys.exit(f"member {member} came twice")
            seen.add(member)
            if row["outcome"] != "solved" or row["x1"] != ends[member]:
                sys.exit(f"member {member} is {row}, and by the engine {ends[member]}")
    if len(seen) != len(ends):
        sys.exit(f"{len(seen)} of {len(ends)} members have a result")


def main():
    arguments = [word for word in sys.argv[1:] if not word.startswith("--")]
    if len(arguments) < 2:
        sys.exit(__doc__)
    dlcs, dlcsd = (os.path.abspath(path) for path in arguments[:2])
    members = int(arguments[2].replace(",", "")) if len(arguments) > 2 else 1_000_000
    with tempfile.TemporaryDirectory(prefix="dlcs-ensemble-bench-") as name:
        folder = pathlib.Path(name)
        before = processor_seconds()
        ends, engine_seconds = run_engines(dlcs, folder, members)
        engine_cpu = processor_seconds() - before
        print(f"four engines: {engine_seconds:.1f} s, {members / engine_seconds:,.0f}/s, cpu {engine_cpu:.1f} s")
        database = Database(fsync=True)
        try:
            before = processor_seconds()
            fleet = Fleet(dlcsd, f"postgresql://dlcs@/dlcs?host={database.folder}")
            results, job_seconds, created = run_job(dlcs, fleet, folder, members, "--no-kills" not in sys.argv)
            fleet.stop()
        finally:
            database.stop()
        job_cpu = processor_seconds() - before  # with that of PostgreSQL
        check(results, ends)
        print(
            f"the job:      {job_seconds:.1f} s, {members / job_seconds:,.0f}/s, cpu {job_cpu:.1f} s"
            f" (created after {created:.1f} s)"
        )
        print(f"ratio:        {engine_seconds / job_seconds:.3f}; every result once, with the bits of the engine")


if __name__ == "__main__":
    main()
