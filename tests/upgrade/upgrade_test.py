#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What programs of an earlier version said and left behind (README.md), in the hands of this one.

    upgrade_test.py DLCSD DLCS
"""

import base64
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

DLCSD, DLCS = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "e2e"), str(ROOT / "client" / "python" / "src")]
os.environ.pop("DLCS_SERVER", None)

import grpc  # noqa: E402
from database import Database  # noqa: E402
from dlcs import messages  # noqa: E402

RECORDED = pathlib.Path(__file__).resolve().parent / "before-ranks"
EXAMPLES = ROOT / "deploy" / "examples"
SCRATCH = tempfile.TemporaryDirectory()
# As record.py has submitted them.
UNFINISHED = {
    "interrupted": ["--method", "time-stepping", "--steps", "1000000", "--no-estimate-error", "--at", "0:0.25:2"],
    "queued": ["--method", "time-stepping", "--steps", "200", "--at", "0:0.25:1"],
}
# Events that a watcher may miss, and others may have.
TRANSIENT = {"iterate", "window_started", "window_finished", "window_rejected", "log", "gap", "heartbeat"}
# What answers do not have any more: errors_y took the place of errors_by, what steps that were given cost in accuracy
# is in the text of the verdict, and no member fails because they do not resolve y.
ENDED = ("summary.accuracy.errors_by", "summary.verdict.concerns", "summary.failed")


def dlcs(*words, codes=(0,)):
    done = subprocess.run([str(DLCS), *map(str, words)], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode in codes, (words, done.returncode, done.stderr)
    return done.stdout


def trajectory(*words, codes=(0,)):
    file = pathlib.Path(SCRATCH.name) / "result.json"
    dlcs(*words, "--output", file, codes=codes)
    return json.loads(file.read_text())["trajectory"]


def as_told(now, then):
    """What `now` has of what `then` has."""
    if not isinstance(now, dict) or not isinstance(then, dict):
        return now
    return {key: as_told(now.get(key), value) for key, value in then.items()}


class Server:
    def __init__(self, store):
        command = [DLCSD, "--store", store, "--listen", "127.0.0.1:0", "--threads", "1", "--worker-name", "w"]
        self.process = subprocess.Popen(
            list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        self.address = self.process.stdout.readline().split()[-1]

    def job(self, name):
        return json.loads(dlcs("get", name, "--server", self.address, "-o", "json"))

    def end(self, name):
        deadline = time.monotonic() + 60
        while (job := self.job(name))["state"] in ("JOB_STATE_QUEUED", "JOB_STATE_RUNNING"):
            assert time.monotonic() < deadline, job
            time.sleep(0.1)
        return job

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        code = self.process.wait(30)
        self.process.stdout.close()
        return code


class StoreTest:
    """A store that servers of the earlier version have left, of which one was killed."""

    @classmethod
    def setUpClass(cls):
        cls.said = json.loads((RECORDED / "jobs.json").read_text())[cls.kind]
        cls.server = Server(cls.store())

    def test_what_had_ended_is_what_it_was(self):
        for title in ("steps", "windows", "cancelled"):
            job = self.said[title]["job"]
            now = self.server.job(job["name"])
            self.assertEqual(as_told(now, job), job)
            codes = (3,) if title == "cancelled" else (0,)
            found = trajectory("result", job["name"], "--server", self.server.address, codes=codes)
            expected = self.said[title]["trajectory"]
            self.assertEqual({key: found.get(key) for key in expected}, expected)  # to the bit

    def test_what_had_not_ended_goes_on(self):
        for title, options in UNFINISHED.items():
            name = self.said[title]["job"]["name"]
            job = self.server.end(name)
            self.assertEqual(job["state"], "JOB_STATE_SUCCEEDED", job)
            codes = (0, 1)  # few steps are no usable answer
            found = trajectory("result", name, "--server", self.server.address, codes=codes)
            local = trajectory("solve", EXAMPLES / "rectifier.json", "--local", *options, codes=codes)
            self.assertEqual({key: found[key] for key in ("times", "x", "y", "w")},
                             {key: local[key] for key in ("times", "x", "y", "w")})
            watched = dlcs("watch", name, "--server", self.server.address, "--format", "json", codes=codes)
            events = [json.loads(line) for line in watched.splitlines()]
            states = [event["state"].removeprefix("JOB_STATE_") for event in events if "state" in event]
            again = ["RUNNING"] if title == "interrupted" else []
            self.assertEqual(states, ["QUEUED", "RUNNING", *again, "SUCCEEDED"])

    def test_all_are_listed(self):
        listed = dlcs("list", "--server", self.server.address, "-o", "name").split()
        self.assertEqual(sorted(listed), sorted(said["job"]["name"] for said in self.said.values()))


class SqliteStoreTest(StoreTest, unittest.TestCase):
    kind = "sqlite"

    @classmethod
    def store(cls):
        return shutil.copy(RECORDED / "jobs.db", SCRATCH.name)

    @classmethod
    def tearDownClass(cls):
        assert cls.server.stop() == 0


class PostgresStoreTest(StoreTest, unittest.TestCase):
    kind = "postgresql"

    @classmethod
    def store(cls):
        cls.database = Database()
        load = cls.database.command(
            "psql", "--host", cls.database.folder, "--username", "dlcs", "--no-psqlrc", "--quiet", "--set",
            "ON_ERROR_STOP=1", "dlcs",
        )  # fmt: skip
        dump = (RECORDED / "jobs.sql").read_text()
        subprocess.run(load, input=dump, capture_output=True, text=True, check=True)
        return f"postgresql://dlcs@/dlcs?host={cls.database.folder}"

    @classmethod
    def tearDownClass(cls):
        assert cls.server.stop() == 0
        cls.database.stop()


def fields_set(message, path=""):
    """The paths of all fields that have a value, of elements of lists together."""
    found = set()
    for field, value in message.ListFields():
        name = f"{path}.{field.name}" if path else field.name
        found.add(name)
        if field.message_type is not None and not field.message_type.GetOptions().map_entry:
            for part in value if hasattr(value, "append") or hasattr(value, "add") else [value]:
                found |= fields_set(part, name)
    return found


class CallsTest(unittest.TestCase):
    """Calls of the earlier `dlcs`, byte for byte but for the names of jobs."""

    def test_each_is_answered_with_all_that_it_was(self):
        calls = json.loads((RECORDED / "calls.json").read_text())
        self.assertGreater(len({call["method"] for call in calls}), 12)
        server = Server(pathlib.Path(SCRATCH.name) / "calls.db")
        self.addCleanup(server.stop)
        names = {}  # then: now
        with grpc.insecure_channel(server.address) as channel:
            for call in calls:
                self.replay(call, channel, names, server)

    def replay(self, call, channel, names, server):
        decoded = {key: [base64.b64decode(part) for part in call[key]] for key in ("requests", "responses")}
        for then, now in names.items():
            decoded["requests"] = [part.replace(then, now) for part in decoded["requests"]]
        _, service, method = call["method"].replace("dlcs.v1.", "").split("/")[-3:]
        described = next(m for m in messages.service(service).methods if m.name == method)
        if method == "DeleteSolveJob" and call["code"] == "OK":
            # It was deleted after its end; a cancelled job takes a moment to end.
            name = messages.class_of(described.input_type).FromString(decoded["requests"][0]).name
            while server.job(name)["state"] in ("JOB_STATE_QUEUED", "JOB_STATE_RUNNING", "JOB_STATE_CANCELLING"):
                time.sleep(0.02)
        responses, code = [], "OK"
        try:
            for response in channel.stream_stream(call["method"])(iter(decoded["requests"]), timeout=60):
                responses.append(response)
        except grpc.RpcError as error:
            code = error.code().name
        self.assertEqual(code, call["code"], call["method"])
        pattern = re.compile(rb"jobs/([a-z2-7]{26})")
        for then, now in zip(decoded["responses"], responses):
            if then_name := pattern.search(then):
                names.setdefault(then_name[1], pattern.search(now)[1])
        if method == "CreateSolveJob":
            # What the client did next, it did with a job that ran.
            name = messages.SolveJob.FromString(responses[0]).name
            while server.job(name)["state"] == "JOB_STATE_QUEUED":
                time.sleep(0.02)
        kind = messages.class_of(described.output_type)
        then, now = (set().union(*(fields_set(kind.FromString(part)) for part in parts)) if parts else set()
                     for parts in (decoded["responses"], responses))
        missing = {path for path in then - now if path.split(".")[0] not in TRANSIENT and not path.endswith(ENDED)}
        self.assertEqual(missing, set(), call["method"])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
