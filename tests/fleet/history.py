# SPDX-License-Identifier: Apache-2.0
"""Clients that submit and follow jobs and remember what they were told, and what must be true of all of it."""

import collections
import pathlib
import random
import struct
import subprocess
import sys
import tempfile
import threading
import time

STUBS = tempfile.TemporaryDirectory()


def generate_stubs(proto):
    plugin = subprocess.run(["which", "grpc_python_plugin"], check=True, capture_output=True, text=True).stdout.strip()
    files = ["dlcs/v1/solver.proto", "dlcs/v1/jobs.proto", "google/rpc/status.proto"]
    out = [f"--python_out={STUBS.name}", f"--grpc_out={STUBS.name}", f"--plugin=protoc-gen-grpc={plugin}"]
    subprocess.run(["protoc", f"--proto_path={proto}", *out, *files], check=True)
    sys.path.insert(0, STUBS.name)
    # google is a package of the system's protobuf already.
    import google

    google.__path__.append(str(pathlib.Path(STUBS.name) / "google"))


generate_stubs(pathlib.Path(__file__).resolve().parents[2] / "proto")
import grpc  # noqa: E402
from dlcs.v1 import jobs_pb2, jobs_pb2_grpc, solver_pb2  # noqa: E402

TIMES = (0.5, 1, 2)
CALL_S = 5  # a front that is frozen or cut off answers nothing
FINAL = (solver_pb2.JOB_STATE_SUCCEEDED, solver_pb2.JOB_STATE_FAILED, solver_pb2.JOB_STATE_CANCELLED)
# What a client repeats; all else is a fault of the service.
TRANSIENT = (
    grpc.StatusCode.UNAVAILABLE,
    grpc.StatusCode.DEADLINE_EXCEEDED,
    grpc.StatusCode.RESOURCE_EXHAUSTED,
    grpc.StatusCode.CANCELLED,  # of calls that reach a server at its very end; no client here cancels
)


class Solves:
    """Solves of one problem with different numbers of steps, most of them small."""

    def __init__(self, dlcs, example):
        self.dlcs = dlcs
        self.example = example
        self.bits = {}

    def steps(self, number):
        return 400_000 + 1000 * (number % 5) if number % 29 == 7 else 500 + 100 * (number % 17)

    def request(self, number):
        one = lambda value: solver_pb2.Matrix(dense=solver_pb2.DenseMatrix(rows=1, columns=1, values=[value]))  # noqa
        formula = lambda text: solver_pb2.TimeFunction(  # noqa: E731
            pieces=[solver_pb2.TimePiece(formulas=solver_pb2.FormulaFunction(formulas=[text]))]
        )
        return solver_pb2.SolveRequest(
            problem=solver_pb2.Problem(
                a=one(-1), b=one(10), n=one(1), m=one(0.1), f=formula("0"), g=formula("-10*sin(2*pi*t)"), x0=[0],
                horizon=2
            ),  # fmt: skip
            options=solver_pb2.SolveOptions(
                method=solver_pb2.METHOD_TIME_STEPPING, steps=self.steps(number), output_times=TIMES
            ),
        )

    def expected(self, number):
        """The values of t, x, y and w that `dlcs solve --local` prints, which can be read back to the same bits."""
        steps = self.steps(number)
        if steps not in self.bits:
            text = subprocess.run(
                [self.dlcs, "solve", "--local", self.example, "--method", "time-stepping", "--steps", str(steps),
                 "--at", ",".join(map(str, TIMES)), "--format", "csv", "--quiet"],
                check=True, capture_output=True, text=True
            ).stdout  # fmt: skip
            rows = [list(map(float, line.split(","))) for line in text.splitlines()[1:]]
            self.bits[steps] = bits([value for column in zip(*rows) for value in column])
        return self.bits[steps]


def bits(values):
    return struct.pack(f"<{len(values)}d", *values)


class Job:
    def __init__(self, number):
        self.number = number
        self.request_id = f"job-{number}"
        self.name = None  # once it is acknowledged
        self.durable = None  # the numbers of its durable events, where it was watched


class Clients:
    """Each submits a job, follows it, and reads its result; calls go to any of the fronts, and are repeated."""

    def __init__(self, fronts, solves, seed, at_once=24, patience=180):
        options = [("grpc.max_reconnect_backoff_ms", 500), ("grpc.initial_reconnect_backoff_ms", 100)]
        self.stubs = [jobs_pb2_grpc.JobServiceStub(grpc.insecure_channel(front, options)) for front in fronts]
        self.solves = solves
        self.patience = patience
        self.faults = []
        self.jobs = []
        self.done = 0
        self.repeated = collections.Counter()
        self.longest = 0
        self.mutex = threading.Lock()
        self.stopped = False
        self.random = random.Random(seed)
        self.threads = [threading.Thread(target=self.work, daemon=True) for _ in range(at_once)]
        for number in range(29):
            solves.expected(number)  # before there is anything to wait for

    def start(self):
        for thread in self.threads:
            thread.start()

    def join(self):
        for thread in self.threads:
            thread.join()

    def fault(self, text):
        with self.mutex:
            self.faults.append(text)
        print(f"FAULT: {text}", flush=True)

    def work(self):
        while not self.stopped:
            with self.mutex:
                job = Job(len(self.jobs))
                self.jobs.append(job)
            begin = time.monotonic()
            try:
                self.live(job)
            except Exception as error:
                self.fault(f"{job.request_id} {job.name}: {error!r}")
            with self.mutex:
                self.done += 1
                self.longest = max(self.longest, time.monotonic() - begin)

    def live(self, job):
        create = jobs_pb2.CreateSolveJobRequest(solve=self.solves.request(job.number), request_id=job.request_id)
        created = self.repeat(lambda stub: stub.CreateSolveJob(create, timeout=CALL_S), f"create {job.request_id}")
        job.name = created.name
        if job.number % 7 == 0:  # an answer that was lost
            again = self.repeat(lambda stub: stub.CreateSolveJob(create, timeout=CALL_S), f"repeat {job.request_id}")
            if again.name != job.name:
                self.fault(f"{job.request_id} is two jobs: {job.name} and {again.name}")
        state = self.watch(job) if job.number % 3 == 0 else self.poll(job)
        if state != solver_pb2.JOB_STATE_SUCCEEDED:
            get = jobs_pb2.GetSolveJobRequest(name=job.name)
            got = self.repeat(lambda stub: stub.GetSolveJob(get, timeout=CALL_S), f"get {job.name}")
            self.fault(f"{job.name} ended as {solver_pb2.JobState.Name(state)}: {got.error.message}")
            return
        got = self.repeat(lambda stub: self.read(stub, job), f"read {job.name}")
        if got != self.solves.expected(job.number):
            self.fault(f"{job.name}: the bits of its result are not those of a local solve")

    def repeat(self, call, what):
        deadline = time.monotonic() + self.patience
        while True:
            try:
                return call(self.random.choice(self.stubs))
            except grpc.RpcError as error:
                self.repeated[error.code().name] += 1
                if error.code() not in TRANSIENT:
                    raise RuntimeError(f"{what}: {error.code().name} {error.details()}") from error
                if time.monotonic() > deadline:
                    raise RuntimeError(f"no answer for {self.patience} s: {what}: {error.details()}") from error
            time.sleep(0.1)

    def poll(self, job):
        deadline = time.monotonic() + self.patience
        get = jobs_pb2.GetSolveJobRequest(name=job.name)
        while True:
            state = self.repeat(lambda stub: stub.GetSolveJob(get, timeout=CALL_S), f"get {job.name}").state
            if state in FINAL:
                return state
            if time.monotonic() > deadline:
                raise RuntimeError(f"{job.name} has not ended within {self.patience} s")
            time.sleep(0.2)

    def watch(self, job):
        """Every number comes once and in order, or in a gap that is told; what is durable comes."""
        deadline = time.monotonic() + self.patience
        last, states, ended = 0, [], False
        job.durable = []
        while not ended:
            request = jobs_pb2.WatchSolveJobRequest(name=job.name, after_sequence=last)
            try:
                for event in self.random.choice(self.stubs).WatchSolveJob(request, timeout=2 * CALL_S):
                    kind = event.WhichOneof("kind")
                    if kind == "heartbeat":
                        continue
                    first = event.gap.first_sequence if kind == "gap" else event.sequence
                    if first != last + 1:
                        self.fault(f"{job.name}: {kind} {first} follows event {last}")
                    last = event.gap.last_sequence if kind == "gap" else event.sequence
                    if kind == "state":
                        states.append(event.state)
                    if kind in ("state", "analysis", "checkpointed", "summary"):
                        job.durable.append(event.sequence)
                    ended = ended or kind == "summary"
            except grpc.RpcError as error:
                self.repeated[error.code().name] += 1
                if error.code() not in TRANSIENT:
                    raise RuntimeError(f"watch {job.name} {last}: {error.code().name} {error.details()}") from error
            if time.monotonic() > deadline:
                raise RuntimeError(f"{job.name} has not ended within {self.patience} s, as watched")
            if not ended:
                time.sleep(0.1)
        if states[0] != solver_pb2.JOB_STATE_QUEUED or [state for state in states if state in FINAL] != states[-1:]:
            self.fault(f"{job.name}: states {states}")
        return states[-1]

    @staticmethod
    def read(stub, job):
        columns = [[], [], [], []]
        for page in stub.ReadTrajectory(jobs_pb2.ReadTrajectoryRequest(name=job.name), timeout=CALL_S):
            chunk = page.chunk
            for column, values in zip(columns, (chunk.times, chunk.x, chunk.y, chunk.w)):
                column.extend(values)
        return bits([value for column in columns for value in column])


def check_store(clients, sql):
    """What the database has at the end is what clients were told, once. `sql` runs a statement there."""
    acknowledged = {job.request_id: job for job in clients.jobs if job.name is not None}
    stored = {
        request: (name, int(state), int(sequence), float(progress))
        for request, name, state, sequence, progress in sql(
            "SELECT convert_from(request_id, 'UTF8'), id, state, sequence, progress FROM jobs"
        )
    }
    count = int(sql("SELECT count(*) FROM jobs")[0][0])
    if count != len(stored):
        clients.fault(f"{count} jobs of {len(stored)} requests: some were made twice")
    for request in stored.keys() - {job.request_id for job in clients.jobs}:
        clients.fault(f"{request} was never asked for")
    for request, job in acknowledged.items():
        if request not in stored or job.name != "jobs/" + stored[request][0]:
            clients.fault(f"{request}, acknowledged as {job.name}, is lost")
        elif stored[request][1] != solver_pb2.JOB_STATE_SUCCEEDED:
            clients.fault(f"{job.name} is in state {stored[request][1]}")
    # Of one life: its first event, one end, its summary as the last event, and all parts of its result.
    wrong = sql(
        "SELECT id FROM jobs LEFT JOIN LATERAL (SELECT min(sequence) AS first, max(sequence) AS last,"
        " count(*) FILTER (WHERE kind = 1 AND payload IN ('SUCCEEDED', 'FAILED', 'CANCELLED')) AS ends,"
        " count(*) FILTER (WHERE kind = 1 AND payload = 'QUEUED') AS queued,"
        " count(*) FILTER (WHERE kind = 4) AS summaries FROM events WHERE job = jobs.number) AS e ON true"
        " LEFT JOIN LATERAL (SELECT count(*) AS parts, COALESCE(max(number) + 1, 0) AS next FROM chunks"
        " WHERE job = jobs.number) AS c ON true WHERE e.ends <> 1 OR e.summaries <> 1 OR e.queued < 1"
        " OR e.first <> 1 OR e.last <> jobs.sequence OR c.parts <> jobs.chunks OR c.next <> c.parts"
    )
    for (name,) in wrong:
        clients.fault(f"jobs/{name}: its events or parts are not those of one life")
    durable = collections.defaultdict(list)
    for name, sequence in sql("SELECT id, events.sequence FROM jobs JOIN events ON job = number ORDER BY 1, 2"):
        durable["jobs/" + name].append(int(sequence))
    for job in acknowledged.values():
        if job.durable is not None and job.durable != durable[job.name]:
            clients.fault(f"{job.name}: a watcher saw {job.durable}, stored are {durable[job.name]}")
