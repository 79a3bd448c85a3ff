#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Records what programs of one version say to each other and leave behind, for upgrade_test.py with later versions.

    tests/upgrade/record.py DLCSD DLCS FOLDER

FOLDER gets calls.json (what the commands of `dlcs` sent, and what `dlcsd` answered), jobs.db and jobs.sql (a store with
jobs in each state, as a file of SQLite and as a dump of PostgreSQL, left by servers that were killed) and jobs.json
(what these servers said of the jobs, and the results).
"""

import atexit
import base64
import contextlib
import json
import os
import pathlib
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from concurrent import futures

import grpc

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "e2e"))
from database import Database  # noqa: E402

DLCSD, DLCS, FOLDER = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
SCRATCH = pathlib.Path(tempfile.mkdtemp(prefix="dlcs-record-"))
EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "deploy" / "examples"
FOUR_ONE, RECTIFIER = EXAMPLES / "example-4.1.json", EXAMPLES / "rectifier.json"


def text(data):
    return base64.b64encode(data).decode()


class Recorder(grpc.GenericRpcHandler):
    """Stands between a client and the server at `address`, and keeps each call."""

    def __init__(self, address):
        self.channel = grpc.insecure_channel(address, [("grpc.max_receive_message_length", -1)])
        self.calls = []

    def service(self, details):
        if details.method.startswith("/grpc."):
            return None

        def pass_on(requests, context):
            call = {"method": details.method, "requests": [], "responses": [], "code": "OK", "message": ""}
            self.calls.append(call)

            def kept():
                for request in requests:
                    call["requests"].append(text(request))
                    yield request

            there = self.channel.stream_stream(details.method)(kept(), timeout=60)
            context.add_callback(there.cancel)
            try:
                for response in there:
                    call["responses"].append(text(response))
                    yield response
            except grpc.RpcError as error:
                call["code"], call["message"] = error.code().name, error.details()
                context.set_trailing_metadata(error.trailing_metadata())
                context.abort(error.code(), error.details())

        return grpc.stream_stream_rpc_method_handler(pass_on)


class Server:
    def __init__(self, store, *flags):
        command = [DLCSD, "--store", store, "--listen", "127.0.0.1:0", "--threads", "1", "--worker-name", "w", *flags]
        self.process = subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, text=True)
        atexit.register(self.process.kill)
        self.address = self.process.stdout.readline().split()[-1]

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()


def dlcs(address, *words, codes=(0,)):
    environment = {**os.environ, "DLCS_SERVER": address}
    done = subprocess.run([str(DLCS), *map(str, words)], capture_output=True, text=True, env=environment, check=False)
    assert done.returncode in codes, (words, done.returncode, done.stderr)
    return done.stdout.strip()


def wait_until(condition):
    deadline = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


# What jobs solve here, as options of `dlcs submit`: an error estimate, windows and iterates, and what takes seconds.
STEPS = ["--method", "time-stepping", "--steps", "200", "--at", "0:0.25:1"]
WINDOWS = ["--method", "laplace-iteration", "--steps", "80", "--window", "20", "--at", "0:0.25:1"]
LONG = ["--method", "time-stepping", "--steps", "1000000", "--no-estimate-error", "--at", "0:0.25:2"]


def record_calls():
    """What each command says to a server, and hears."""
    server = Server(SCRATCH / "calls.db")
    recorder = Recorder(server.address)
    proxy = grpc.server(futures.ThreadPoolExecutor(16), [recorder])
    address = f"127.0.0.1:{proxy.add_insecure_port('127.0.0.1:0')}"
    proxy.start()
    (SCRATCH / "lcp.json").write_text(json.dumps({"M": [[2, 1], [1, 2]], "q": [-5, -6]}))
    (SCRATCH / "members.json").write_text(json.dumps({"members": [{"x0": [k / 4]} for k in range(3)]}))
    dlcs(address, "capabilities")
    dlcs(address, "lcp", SCRATCH / "lcp.json")
    dlcs(address, "analyze", FOUR_ONE)
    dlcs(address, "solve", FOUR_ONE, *STEPS)  # a job, since the server has a store
    dlcs(address, "solve", RECTIFIER, *STEPS, "--theta", "3", codes=(2,))
    dlcs(address, "ensemble", RECTIFIER, SCRATCH / "members.json", *STEPS, codes=(0, 1))
    job = dlcs(address, "submit", FOUR_ONE, *WINDOWS, "--title", "windows", "--priority", "3")
    dlcs(address, "watch", job, "--values", "sampled", "--format", "json")
    dlcs(address, "get", job)
    dlcs(address, "result", job, "--output", SCRATCH / "result.json")
    problem = dlcs(address, "upload", RECTIFIER)
    other = dlcs(address, "submit", problem, *LONG)
    wait_until(lambda: described(server, other)["state"] == "JOB_STATE_RUNNING")
    dlcs(address, "cancel", other)
    wait_until(lambda: described(server, other)["state"] == "JOB_STATE_CANCELLED")
    dlcs(address, "problems")
    dlcs(address, "list")
    dlcs(address, "delete", other)
    dlcs(address, "get", other, codes=(2, 3))
    proxy.stop(1).wait()
    server.kill()
    (FOLDER / "calls.json").write_text(json.dumps(recorder.calls, indent=0))


def described(server, job):
    return json.loads(dlcs(server.address, "get", job, "-o", "json"))


def record_store(store):
    """Jobs in each state, in the store of a server that is killed. Returns what it said of them."""
    server = Server(store, "--checkpoint-ms", "200")
    jobs = {}

    def submit(title, problem, *options):
        jobs[title] = dlcs(server.address, "submit", problem, *options, "--title", title)
        return jobs[title]

    for title, options in (("steps", STEPS), ("windows", WINDOWS)):
        dlcs(server.address, "watch", submit(title, FOUR_ONE, *options))
    cancelled = submit("cancelled", RECTIFIER, *LONG)
    wait_until(lambda: described(server, cancelled).get("progress", 0) > 0.3)
    dlcs(server.address, "cancel", cancelled)
    wait_until(lambda: described(server, cancelled)["state"] == "JOB_STATE_CANCELLED")
    interrupted = submit("interrupted", RECTIFIER, *LONG)
    submit("queued", dlcs(server.address, "upload", RECTIFIER), *STEPS)
    wait_until(lambda: described(server, interrupted).get("progress", 0) > 0.3)
    said = {}
    for title, job in jobs.items():
        said[title] = {"job": described(server, job)}
        if title in ("steps", "windows", "cancelled"):
            dlcs(server.address, "result", job, "--output", SCRATCH / "result.json", codes=(0, 3))
            said[title]["trajectory"] = json.loads((SCRATCH / "result.json").read_text())["trajectory"]
    server.kill()
    return said


def main():
    FOLDER.mkdir(parents=True, exist_ok=True)
    record_calls()
    said = {"sqlite": record_store(SCRATCH / "jobs.db")}
    with contextlib.closing(sqlite3.connect(SCRATCH / "jobs.db")) as store:  # with what its log holds
        (FOLDER / "jobs.db").unlink(missing_ok=True)
        store.execute("VACUUM INTO ?", (str(FOLDER / "jobs.db"),))
    database = Database()
    try:
        said["postgresql"] = record_store(f"postgresql://dlcs@/dlcs?host={database.folder}")
        dump = database.command("pg_dump", "--host", database.folder, "--username", "dlcs", "--no-owner", "dlcs")
        (FOLDER / "jobs.sql").write_bytes(subprocess.run(dump, capture_output=True, check=True).stdout)
    finally:
        database.stop()
    (FOLDER / "jobs.json").write_text(json.dumps(said, indent=0))
    shutil.rmtree(SCRATCH)


main()
