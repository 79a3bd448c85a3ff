# SPDX-License-Identifier: Apache-2.0
"""A PostgreSQL server for tests and measurements."""

import os
import pathlib
import pwd
import shutil
import subprocess
import tempfile
import time


class Database:
    """A PostgreSQL server with the database that OPERATIONS.md makes, on a Unix socket in a folder of its own. With
    fsync=False it is quick, and loses data where the machine fails."""

    def __init__(self, fsync=False):
        self.folder = tempfile.mkdtemp(prefix="dlcs-documents-")
        self.programs = sorted(pathlib.Path("/usr/lib/postgresql").glob("*/bin"))[-1]
        self.user = []
        if os.geteuid() == 0:  # PostgreSQL refuses root
            user = pwd.getpwnam("postgres")
            os.chown(self.folder, user.pw_uid, user.pw_gid)
            self.user = ["setpriv", "--reuid", str(user.pw_uid), "--regid", str(user.pw_gid), "--clear-groups"]
        data = f"{self.folder}/data"
        names = ("--username", "dlcs", "--auth", "trust", "--encoding", "UTF8")
        self.call("initdb", "--pgdata", data, *names, "--no-sync")
        self.server = subprocess.Popen(
            [
                *self.command("postgres", "-D", data, "-k", self.folder),
                *("-c", "listen_addresses=", "-c", f"fsync={'on' if fsync else 'off'}"),
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        deadline = time.monotonic() + 60
        while subprocess.run(self.command("pg_isready", "--host", self.folder), capture_output=True).returncode != 0:
            if time.monotonic() > deadline:
                raise RuntimeError("PostgreSQL does not start")
            time.sleep(0.05)
        self.call("createdb", "--host", self.folder, "--username", "dlcs", "--template", "template0", "dlcs")
        self.socket = f"{self.folder}/.s.PGSQL.5432"

    def command(self, program, *arguments):
        return [*self.user, self.programs / program, *arguments]

    def call(self, program, *arguments):
        subprocess.run(self.command(program, *arguments), capture_output=True, check=True)

    def stop(self):
        self.server.terminate()
        self.server.wait(timeout=60)
        shutil.rmtree(self.folder, ignore_errors=True)
