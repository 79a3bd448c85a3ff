#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Three fronts, six workers with wrong clocks, and a PostgreSQL with a synchronous standby, each on a machine of its
own, of which this program breaks one after the other while clients submit and follow jobs.

    tests/fleet/fleet_test.py DLCSD DLCS [--jobs 100] [--between 10] [--seed 1] [--only FAULT,...] [--other DLCSD]

With --other, all servers are that program at first, and one of the two at each further start, as in a rolling upgrade
and back. Faults go on until so many jobs have ended, each kind at least once, and so many jobs end between two of them.
Exit status 0 if all that was acknowledged is true (README.md), 77 where there are no network namespaces.
"""

import argparse
import os
import pathlib
import random
import shutil
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent))
os.environ.setdefault("GRPC_ENABLE_FORK_SUPPORT", "0")
from network import Network, enter_namespaces  # noqa: E402

enter_namespaces()
import grpc  # noqa: E402
from history import TRANSIENT, Clients, Solves, check_store, jobs_pb2, jobs_pb2_grpc  # noqa: E402
from machines import Database, Relay, Server, wait_until  # noqa: E402

EXAMPLE = pathlib.Path(__file__).resolve().parents[2] / "deploy" / "examples" / "rectifier.json"
LEASE_S = 1
CLOCKS = {"f2": 300, "f3": -300, "w1": 300, "w2": -300}
# They reach the databases through a relay, and clients reach this front through another.
FAR = ("f1", "w5", "w6")


class Fleet:
    def __init__(self, programs, folder):
        self.programs = programs
        self.folder = folder
        self.network = Network()
        self.primary, self.standby = (Database(self.network.machine(name), folder) for name in ("d1", "d2"))
        self.databases = [self.primary, self.standby]
        self.primary.create()
        self.standby.follow(self.primary)
        addresses = [database.machine.address for database in self.databases]
        to_databases = [f"{5001 + k}={address}:5432" for k, address in enumerate(addresses)]
        self.to_databases = Relay(self.network.machine("far-db"), folder, to_databases)
        relayed = [f"{self.to_databases.machine.address}:{5001 + k}" for k in range(len(addresses))]
        # A host that does not answer is passed over after 2 s; a connection whose data is not confirmed ends after 5 s.
        settings = "target_session_attrs=read-write&connect_timeout=2&tcp_user_timeout=5000"
        near, far = (f"postgresql://dlcs@{','.join(hosts)}/dlcs?{settings}" for hosts in (addresses, relayed))
        store = lambda name: far if name in FAR else near  # noqa: E731
        self.fronts = [self.server(name, "front", store(name)) for name in ("f1", "f2", "f3")]
        self.workers = [self.server(name, "worker", store(name)) for name in ("w1", "w2", "w3", "w4", "w5", "w6")]
        front = self.fronts[0]
        self.to_front = Relay(self.network.machine("far-front"), folder, [f"50051={front.address}"])
        front.address = f"{self.to_front.machine.address}:50051"
        for server in self.servers():
            server.start()
        for server in self.servers():
            server.wait()

    def server(self, name, role, store, machine=None):
        flags = ["--lease-ms", str(int(1000 * LEASE_S)), "--checkpoint-ms", "20", "--max-queued-jobs-per-user", "1000"]
        machine = machine or self.network.machine(name)
        return Server(machine, self.programs, role, store, self.folder, CLOCKS.get(name, 0), flags)

    def servers(self):
        return [*self.fronts, *self.workers]

    def databases_of(self, server):
        """The machines where it finds the databases."""
        if server.machine.name in FAR:
            return [self.to_databases.machine]
        return [database.machine for database in self.databases]


class Faults:
    """Each takes some seconds, and the fleet is whole again when it returns."""

    def __init__(self, fleet, clients, seed):
        self.fleet = fleet
        self.clients = clients
        self.random = random.Random(seed)
        self.ways = ["killed", "frozen", "unplugged"]  # of losing a primary
        self.random.shuffle(self.ways)

    def check_servers(self):
        for server in self.fleet.servers():
            if not server.is_up:
                self.clients.fault(f"{server.machine.name} ended by itself")
                server.start()
                server.wait()

    def recover(self, jobs):
        """Until so many further jobs have ended."""
        goal = self.clients.done + jobs
        try:
            wait_until(lambda: self.clients.done >= goal, 90, f"{jobs} further jobs")
        except RuntimeError as error:
            self.clients.fault(f"the fleet does not recover: {error}")

    def pause(self, least, most):
        time.sleep(self.random.uniform(least, most))

    def some(self, servers, most):
        return self.random.sample(servers, self.random.randint(1, most))

    def servers(self, most_workers):
        return self.some(self.fleet.workers, most_workers) + self.some(self.fleet.fronts, 1)

    def kill_servers(self):
        victims = self.servers(3)
        for server in victims:
            server.kill()
        self.pause(0, 2 * LEASE_S)
        for server in victims:
            server.start()
        for server in victims:
            server.wait()

    def freeze_servers(self):
        victims = self.servers(3)
        for server in victims:
            server.freeze()
        self.pause(0.1, 3 * LEASE_S)
        for server in victims:
            server.thaw()

    def cut_servers_from_the_database(self):
        victims = self.servers(2)
        for server in victims:
            server.machine.cut(*self.fleet.databases_of(server))
        self.pause(0.5, 4 * LEASE_S)
        for server in victims:
            server.machine.mend(*self.fleet.databases_of(server))

    def unplug_servers(self):
        victims = self.servers(2)
        for server in victims:
            server.machine.unplug()
        self.pause(0.5, 4 * LEASE_S)
        for server in victims:
            server.machine.plug()

    def slow_links(self):
        victims = self.some(self.fleet.servers(), 4)
        for server in victims:
            server.machine.slow()
        self.pause(1, 3)
        for server in victims:
            server.machine.unslow()

    def lengthen_ways(self):
        """A front and two workers are 50 to 200 ms from the databases and back, and the clients as far from the front.
        The longer ones are too long for the leases of this test."""
        for way in (self.fleet.to_databases, self.fleet.to_front):
            way.set_delay(self.random.uniform(0.025, 0.1))
        self.pause(2, 4)
        for way in (self.fleet.to_databases, self.fleet.to_front):
            way.set_delay(0)

    def kill_the_primary(self):
        self.fleet.primary.kill()
        self.pause(0, 1)
        self.fleet.primary.start()

    def freeze_the_primary(self):
        self.fleet.primary.freeze()
        self.pause(0.5, 4)
        self.fleet.primary.thaw()

    def lose_the_standby(self):
        """Nothing can be committed meanwhile."""
        self.fleet.standby.freeze()
        self.pause(0.5, 4)
        self.fleet.standby.thaw()

    def cut_the_standby_off(self):
        self.fleet.standby.machine.cut(self.fleet.primary.machine)
        self.pause(0.5, 4)
        self.fleet.standby.machine.mend(self.fleet.primary.machine)

    def roll(self):
        """A restart of one server after the other, as for an upgrade."""
        for server in self.fleet.servers():
            if server.end() != 0:
                self.clients.fault(f"{server.machine.name} did not end in good order")
            server.start()
            server.wait()

    def fail_over(self):
        """The primary is lost, the standby becomes the primary, and the lost one wakes up before it is told."""
        fleet = self.fleet
        old, new = fleet.primary, fleet.standby
        how = self.ways.pop(0)
        self.ways.append(how)
        print(f"  {old.machine.name} is {how}, {new.machine.name} takes over", flush=True)
        {"killed": old.kill, "frozen": old.freeze, "unplugged": old.machine.unplug}[how]()
        self.pause(2, 3)  # OPERATIONS.md says why not sooner
        new.promote()
        fleet.primary, fleet.standby = new, old
        if how == "killed":
            old.start(wait=False)
        elif how == "frozen":
            old.thaw()
        wait_until(old.answers, 60, "the old primary answers")
        self.check_that_it_is_fenced(old)
        self.pause(0, 2)
        if how == "unplugged":
            old.machine.plug()
            self.pause(0, 2)
        old.follow(new)

    def check_that_it_is_fenced(self, old):
        """A front that knows only the old primary takes no job, and a worker claims none there."""
        fleet = self.fleet
        before = old.sql("SELECT count(*), max(fence), count(*) FILTER (WHERE finished IS NULL) FROM jobs")
        store = f"host={old.folder} user=dlcs dbname=dlcs target_session_attrs=read-write"
        front = fleet.server("of-the-old", "all", store, machine=old.machine)
        front.address = f"unix:{old.folder}/front"  # reached also where the machine is unplugged
        front.command[front.command.index("--listen") + 1] = front.address
        front.start()
        front.wait()
        try:
            stub = jobs_pb2_grpc.JobServiceStub(grpc.insecure_channel(front.address))
            create = jobs_pb2.CreateSolveJobRequest(solve=self.clients.solves.request(1), request_id="never")
            deadline = time.monotonic() + 3
            while time.monotonic() < deadline:
                try:
                    got = stub.CreateSolveJob(create, timeout=2)
                    self.clients.fault(f"the old primary acknowledges {got.name}")
                    return
                except grpc.RpcError as error:
                    if error.code() not in TRANSIENT:
                        self.clients.fault(f"on the old primary: {error.code().name} {error.details()}")
                time.sleep(0.1)
            after = old.sql("SELECT count(*), max(fence), count(*) FILTER (WHERE finished IS NULL) FROM jobs")
            if after != before:
                self.clients.fault(f"the old primary went on: {before}, then {after}")
        finally:
            front.kill()

    def all(self):
        return [
            self.kill_servers,
            self.freeze_servers,
            self.cut_servers_from_the_database,
            self.unplug_servers,
            self.slow_links,
            self.lengthen_ways,
            self.kill_the_primary,
            self.freeze_the_primary,
            self.lose_the_standby,
            self.cut_the_standby_off,
            self.roll,
            self.fail_over,
        ]


def main():
    options = argparse.ArgumentParser()
    options.add_argument("dlcsd", type=pathlib.Path)
    options.add_argument("dlcs", type=pathlib.Path)
    options.add_argument("--jobs", type=int, default=100)
    options.add_argument("--between", type=int, default=10)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--only")
    options.add_argument("--other", type=pathlib.Path)
    asked = options.parse_args()
    folder = pathlib.Path(tempfile.mkdtemp(prefix="dlcs-fleet-"))
    solves = Solves(asked.dlcs, EXAMPLE)
    fleet = Fleet([program.resolve() for program in (asked.dlcsd, asked.other) if program], folder)
    clients = Clients([front.address for front in fleet.fronts], solves, asked.seed)
    faults = Faults(fleet, clients, asked.seed)
    known = [fault for fault in faults.all() if not asked.only or fault.__name__ in asked.only.split(",")]
    clients.start()
    begin = time.monotonic()
    count = 0
    while clients.done < asked.jobs or count < len(known):
        if count % len(known) == 0:
            faults.random.shuffle(known)
        fault = known[count % len(known)]
        count += 1
        print(f"{time.monotonic() - begin:6.1f} s {clients.done:6} jobs  {fault.__name__}", flush=True)
        fault()
        faults.recover(asked.between)
        faults.check_servers()
        if len(clients.faults) > 20 or time.monotonic() > begin + 60 * 60:
            break
    clients.stopped = True
    clients.join()
    check_store(clients, fleet.primary.sql)
    seconds = time.monotonic() - begin
    print(f"{clients.done} jobs in {seconds:.0f} s, {count} faults, the longest job {clients.longest:.1f} s, seed "
          f"{asked.seed}; calls that were repeated: {dict(clients.repeated)}")
    if clients.faults:
        print(f"{len(clients.faults)} faults of the service; logs in {folder}")
        sys.stdout.flush()
        os._exit(1)
    print("all that was acknowledged is true", flush=True)
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(0)  # with all that runs


if __name__ == "__main__":
    main()
