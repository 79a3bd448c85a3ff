# SPDX-License-Identifier: Apache-2.0
"""What runs on the machines: a PostgreSQL with a synchronous standby, and dlcsd in its roles."""

import os
import pathlib
import pwd
import random
import shutil
import signal
import subprocess
import sys
import time

PROGRAMS = sorted(pathlib.Path("/usr/lib/postgresql").glob("*/bin"))[-1]


def wait_until(condition, seconds, what):
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise RuntimeError(f"not within {seconds} s: {what}")
        time.sleep(0.05)


class Process:
    def __init__(self, log):
        self.process = None
        self.log = open(log, "ab")

    def launch(self, command, environment=None):
        self.begin = os.path.getsize(self.log.name)
        self.process = subprocess.Popen(
            [str(part) for part in command], stdout=self.log, stderr=self.log, env={**os.environ, **(environment or {})}
        )

    def has_said(self, text):
        """Since it was launched."""
        with open(self.log.name) as log:
            log.seek(self.begin)
            return text in log.read()

    @property
    def is_up(self):
        return self.process is not None and self.process.poll() is None

    def family(self):
        """The process and its children."""
        parents = {}
        for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
            try:
                fields = stat.read_text().rpartition(")")[2].split()
            except OSError:
                continue
            parents[int(stat.parent.name)] = int(fields[1])
        return [self.process.pid, *(child for child, parent in parents.items() if parent == self.process.pid)]

    def signal(self, number):
        for pid in self.family():
            try:
                os.kill(pid, number)
            except ProcessLookupError:
                pass

    def freeze(self):
        self.signal(signal.SIGSTOP)
        self.signal(signal.SIGSTOP)  # children of a moment ago

    def thaw(self):
        self.signal(signal.SIGCONT)

    def kill(self):
        if self.is_up:
            self.signal(signal.SIGKILL)
            self.process.wait()

    def end(self, seconds=60):
        self.process.terminate()
        return self.process.wait(timeout=seconds)


class Relay(Process):
    """A machine through which others are reached, however far they are. `ways`: PORT=HOST:PORT."""

    def __init__(self, machine, folder, ways):
        super().__init__(folder / f"{machine.name}.log")
        self.machine = machine
        self.delay = folder / f"{machine.name}.delay"
        self.set_delay(0)
        program = pathlib.Path(__file__).parent / "relay.py"
        self.launch(machine.command(sys.executable, program, self.delay, machine.address, *ways))
        wait_until(lambda: self.has_said("relay ready"), 30, f"{machine.name} is ready")

    def set_delay(self, seconds):
        """From one end to the other, from now on."""
        new = self.delay.with_suffix(".new")
        new.write_text(str(seconds))
        new.rename(self.delay)


class Server(Process):
    """dlcsd: the last of `programs`, and at each further start one of them. `clock` are the seconds by which its clock
    is wrong. `address` is where clients reach it."""

    def __init__(self, machine, programs, role, store, folder, clock=0, flags=()):
        super().__init__(folder / f"{machine.name}.log")
        self.machine = machine
        self.role = role
        self.address = f"{machine.address}:50051"
        self.programs = programs
        self.command = machine.command(
            programs[0], "--store", store, "--role", role, "--worker-name", machine.name, "--listen", self.address,
            "--insecure-listen", "--threads", "1", *flags
        )  # fmt: skip
        self.environment = {"DLCS_TEST_CLOCK_OFFSET_S": str(clock)}

    def start(self):
        program = self.programs[-1] if self.process is None else random.choice(self.programs)
        self.launch([program if word == self.programs[0] else word for word in self.command], self.environment)

    def wait(self):
        """Until it has started; it may still look for the database."""
        wait_until(lambda: self.has_said("dlcsd listening") or not self.is_up, 60, f"{self.machine.name} starts")


class Database(Process):
    """PostgreSQL. It is quick (fsync=off), and keeps what it has written when it is killed, as opposed to a machine."""

    def __init__(self, machine, folder):
        super().__init__(folder / f"{machine.name}.log")
        self.machine = machine
        self.folder = folder / machine.name
        self.folder.mkdir()
        self.data = self.folder / "data"
        user = pwd.getpwnam("postgres")
        os.chown(self.folder, user.pw_uid, user.pw_gid)
        os.chmod(folder, 0o755)
        self.as_postgres = ["setpriv", "--reuid", user.pw_uid, "--regid", user.pw_gid, "--clear-groups"]

    def call(self, program, *arguments):
        command = [*self.machine.command(*self.as_postgres, PROGRAMS / program), *arguments]
        done = subprocess.run([str(part) for part in command], capture_output=True, text=True, cwd="/")
        if done.returncode != 0:
            raise RuntimeError(f"{program} on {self.machine.name}: {done.stderr}")
        return done.stdout

    def sql(self, statement):
        """The rows, as tuples of text. Over a socket that no cut of the network reaches."""
        names = ("--host", self.folder, "--username", "dlcs", "--no-psqlrc", "--quiet")
        text = self.call("psql", *names, "--tuples-only", "--no-align", "--command", statement, "dlcs")
        return [tuple(line.split("|")) for line in text.splitlines()]

    def create(self):
        self.call("initdb", "--pgdata", self.data, "--username", "dlcs", "--auth", "trust", "--encoding", "UTF8",
                  "--no-sync")
        with open(self.data / "pg_hba.conf", "a") as access:
            access.write("host all all 10.78.0.0/24 trust\nhost replication all 10.78.0.0/24 trust\n")
        with open(self.data / "postgresql.conf", "a") as settings:
            settings.write("fsync = off\nmax_connections = 300\nshared_buffers = 128MB\nwal_keep_size = 256MB\n"
                           "wal_sender_timeout = 5s\nwal_receiver_timeout = 5s\nmax_wal_size = 2GB\n"
                           "wal_retrieve_retry_interval = 200ms\n")
        self.start()
        self.call("createdb", "--host", self.folder, "--username", "dlcs", "--template", "template0", "dlcs")

    def start(self, wait=True):
        self.launch([
            *self.machine.command(*self.as_postgres, PROGRAMS / "postgres", "-D", self.data, "-k", self.folder),
            "-c", f"listen_addresses={self.machine.address}",
        ])  # fmt: skip
        if wait:
            wait_until(self.answers, 60, f"{self.machine.name} answers")

    def answers(self):
        try:
            return bool(self.call("pg_isready", "--host", self.folder))
        except RuntimeError:
            return False

    def follow(self, primary):
        """Becomes a standby, from a copy, and one that the primary waits for."""
        self.kill()
        shutil.rmtree(self.data, ignore_errors=True)
        self.call("pg_basebackup", "--pgdata", self.data, "--write-recovery-conf", "--checkpoint", "fast", "--no-sync",
                  "--wal-method", "fetch",
                  "--dbname", f"host={primary.machine.address} user=dlcs application_name={self.machine.name}")
        self.start()
        streams = "SELECT count(*) FROM pg_stat_replication WHERE state = 'streaming'"
        wait_until(lambda: primary.sql(streams) == [("1",)], 60, f"{self.machine.name} follows")
        primary.wait_for_standby(f'"{self.machine.name}"')
        synchronous = "SELECT count(*) FROM pg_stat_replication WHERE sync_state = 'sync'"
        wait_until(lambda: primary.sql(synchronous) == [("1",)], 60, f"{self.machine.name} is waited for")

    def wait_for_standby(self, standby):
        """Whose copy a commit waits for; "" for nobody's. A standby cannot be told by ALTER SYSTEM."""
        with open(self.data / "postgresql.auto.conf", "a") as settings:
            settings.write(f"synchronous_standby_names = '{standby}'\n")
        self.sql("SELECT pg_reload_conf()")
        wait_until(lambda: self.sql("SHOW synchronous_standby_names") == [(standby,)], 30, "settings are read again")

    def promote(self):
        self.wait_for_standby("")
        self.sql("SELECT pg_promote()")
        wait_until(lambda: self.sql("SELECT pg_is_in_recovery()") == [("f",)], 30, "the standby is the primary")
