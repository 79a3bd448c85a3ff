#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Jobs of dlcsd on two ranks of MPI: results, requests to stop, killed processes, wrong launchers and callers.

    mpi_jobs_test.py MPIRUN DLCS DLCS_MPI DLCSD
"""

import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

MPIRUN, DLCS, DLCS_MPI, DLCSD = (pathlib.Path(word).resolve() for word in sys.argv[1:5])
FOLDER = tempfile.TemporaryDirectory()
# Ranks on one machine need no network. They yield to each other, since there may be more of them than processors.
LAUNCHER = f"{MPIRUN} --allow-run-as-root --oversubscribe --bind-to none -n {{ranks}}"
ENVIRONMENT = {
    **os.environ,
    "OMPI_MCA_btl": "self,vader",
    "OMPI_MCA_btl_vader_single_copy_mechanism": "none",
    "OMPI_MCA_mpi_yield_when_idle": os.environ.get("OMPI_MCA_mpi_yield_when_idle", "1"),
}
for variable in ("DLCS_MPI_RANKS", "DLCS_SERVER", "DLCS_CONTEXT"):
    ENVIRONMENT.pop(variable, None)

STEPS = ["--method", "time-stepping", "--propagator", "iterative-stepping", "--no-estimate-error"]
# Two seconds or more of steps, with a checkpoint every tenth of a second: what is killed is still at work.
SOME = [*STEPS, "--steps", "4000", "--at", "0:0.1:1"]
LONG = [*STEPS, "--steps", "1000000", "--at", "0:0.00002:0.002,1"]


def path(name):
    return str(pathlib.Path(FOLDER.name) / name)


def run(*command, **changes):
    environment = {**ENVIRONMENT, **changes}
    return subprocess.run(
        list(map(str, command)), capture_output=True, text=True, env=environment, timeout=600, check=False
    )


def wall(cells, coefficient=0.02):
    """Heat in a cube with contact at one face."""
    file = path(f"wall-{cells}-{coefficient}.json")
    if not os.path.exists(file):
        made = run(DLCS, "model", "signorini", "--cells", cells, "--dimensions", 3, "--coefficient", coefficient,
                   "--horizon", 1, "--output", file)
        assert made.returncode == 0, made.stderr
    return file


def script(name, text):
    """The path of a shell script."""
    with open(path(name), "w", encoding="utf-8") as file:
        file.write("#!/bin/sh\n" + text)
    os.chmod(path(name), 0o700)
    return path(name)


def wait_until(condition, seconds=60):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        if found := condition():
            return found
        time.sleep(0.1)
    raise AssertionError("not within %g s" % seconds)


def is_alive(process):
    try:
        state = pathlib.Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()[0]
    except OSError:
        return False
    return state != "Z"


def descendants_of(process):
    """All descendants of `process`, with their names."""
    found, parents, processes = [], {process}, []
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            parent = int((folder / "stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()[1])
            processes.append((int(folder.name), parent, (folder / "comm").read_text(encoding="utf-8").strip()))
        except (OSError, ValueError):
            continue
    for child, parent, name in sorted(processes):
        if parent in parents:
            parents.add(child)
            found.append((child, name))
    return found


def variable_of(process, name):
    """A variable in the environment of a process."""
    for entry in pathlib.Path(f"/proc/{process}/environ").read_bytes().split(b"\0"):
        if entry.startswith(name.encode() + b"="):
            return entry.split(b"=", 1)[1].decode()
    return None


class Server:
    """A dlcsd with a store, which starts ranks by `launcher`."""

    def __init__(self, launcher=LAUNCHER, store=None, flags=()):
        self.store = store or tempfile.mktemp(suffix=".db", dir=FOLDER.name)
        self.log = tempfile.mktemp(suffix=".log", dir=FOLDER.name)
        command = [DLCSD, "--listen", "127.0.0.1:0", "--store", self.store, "--checkpoint-ms", 100, "--threads", 4]
        if launcher:
            command += ["--mpi-launcher", launcher, "--mpi-program", DLCS_MPI]
        with open(self.log, "w", encoding="utf-8") as log:
            self.process = subprocess.Popen(
                list(map(str, [*command, *flags])), stdout=subprocess.PIPE, stderr=log, text=True, env=ENVIRONMENT
            )
        line = self.process.stdout.readline()
        if not line:
            raise AssertionError(self.said())
        self.address = line.split()[-1]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise
        finally:
            self.process.stdout.close()

    def said(self):
        return pathlib.Path(self.log).read_text(encoding="utf-8")

    def dlcs(self, *words):
        return run(DLCS, *words, DLCS_SERVER=self.address)

    def submit(self, problem, *options, ranks=2):
        sent = self.dlcs("submit", problem, "--ranks", ranks, *options)
        assert sent.returncode == 0, sent.stderr
        return sent.stdout.strip()

    def job(self, name):
        return json.loads(self.dlcs("get", name, "-o", "json").stdout)

    def end(self, name, seconds=90):
        """Waits for the end of the job and returns it."""
        final = ("JOB_STATE_SUCCEEDED", "JOB_STATE_FAILED", "JOB_STATE_CANCELLED")
        return wait_until(lambda: (job := self.job(name))["state"] in final and job, seconds)

    def trajectory(self, name, code=0):
        file = path("result.json")
        done = self.dlcs("result", name, "--output", file)
        assert done.returncode == code, done.stderr
        with open(file, encoding="utf-8") as opened:
            return json.load(opened)["trajectory"]

    def events(self, name):
        done = self.dlcs("watch", name, "--format", "json")
        return [json.loads(line) for line in done.stdout.splitlines()]

    def ranks(self):
        """The processes of the ranks, in the order of ranks, once they solve."""
        found = [process for process, name in descendants_of(self.process.pid) if name == "dlcs-mpi"]
        numbers = {process: variable_of(process, "OMPI_COMM_WORLD_RANK") for process in found}
        # One that has just ended has no variables.
        return sorted((process for process in found if numbers[process]), key=lambda process: int(numbers[process]))

    def ranks_at_work(self, name, progress=0.05):
        """Waits for a checkpoint of the job, after which its ranks are in their steps."""
        wait_until(lambda: self.job(name).get("progress", 0) > progress)
        return wait_until(lambda: len(found := self.ranks()) == 2 and found)


def same(one, other):
    return all(np.array_equal(one[key], other[key]) for key in ("times", "x", "y", "w"))


def alone(problem, *options):
    """The trajectory of dlcs-mpi on two ranks without a server."""
    file = path("alone.json")
    done = run(*LAUNCHER.format(ranks=2).split(), DLCS_MPI, "--ranks", 2, "solve", problem, *options, "--output", file)
    assert done.returncode == 0, done.stderr
    with open(file, encoding="utf-8") as opened:
        return json.load(opened)["trajectory"]


class MpiJobsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Server()
        cls.addClassCleanup(cls.server.__exit__)
        cls.expected = alone(wall(16), *SOME)

    # Results.

    def succeeds_as_alone(self, server, name):
        job = server.end(name)
        self.assertEqual(job["state"], "JOB_STATE_SUCCEEDED", job)
        self.assertTrue(same(server.trajectory(name), self.expected))
        self.assertEqual(server.ranks(), [])
        return job

    def test_a_job_finds_what_ranks_alone_find(self):
        name = self.server.submit(wall(16), *SOME)
        ranks = self.server.ranks_at_work(name)
        self.assertNotIn(variable_of(ranks[0], "DLCS_MPI_SECRET"), self.server.said())
        self.succeeds_as_alone(self.server, name)
        kinds = [next(key for key in event if key not in ("sequence", "time")) for event in self.server.events(name)]
        for kind in ("state", "analysis", "checkpointed", "summary"):
            self.assertIn(kind, kinds)
        self.assertEqual(kinds[-1], "summary")

    def test_few_pairs_too(self):
        options = ["--method", "laplace-iteration", "--propagator", "contour", "--no-estimate-error", "--steps", "40"]
        name = self.server.submit(wall(8), *options, "--at", "0:0.25:1")
        self.assertEqual(self.server.end(name)["state"], "JOB_STATE_SUCCEEDED")
        self.assertTrue(same(self.server.trajectory(name), alone(wall(8), *options, "--at", "0:0.25:1")))

    def test_a_solve_that_waits_is_a_job_too(self):
        file = path("waited.json")
        done = self.server.dlcs("solve", wall(16), "--ranks", 2, *SOME, "--output", file)
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(file, encoding="utf-8") as opened:
            self.assertTrue(same(json.load(opened)["trajectory"], self.expected))
        self.assertIn("starting 2 ranks", self.server.said())

    def test_two_jobs_at_once(self):
        names = [self.server.submit(wall(16), *SOME, "--title", title) for title in ("one", "other")]
        wait_until(lambda: len(self.server.ranks()) == 4)
        for name in names:
            job = self.server.end(name)
            self.assertEqual(job["state"], "JOB_STATE_SUCCEEDED", job)
            self.assertTrue(same(self.server.trajectory(name), self.expected))

    def test_work_that_is_not_shared_is_named(self):
        with open(path("small.json"), "w", encoding="utf-8") as file:
            json.dump({"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[1]], "f": ["sin(9*t)"], "x0": [0], "T": 1}, file)
        name = self.server.submit(path("small.json"))
        with subprocess.Popen([DLCS, "watch", name, "--format", "json"], stdout=subprocess.PIPE, text=True,
                              env={**ENVIRONMENT, "DLCS_SERVER": self.server.address}) as watch:
            said, _ = watch.communicate(timeout=60)
        self.assertIn("every rank did the same work", said)

    # Refused requests.

    def refused(self, done, *words, code=2):
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)

    def test_ranks_are_refused_where_there_are_none(self):
        with Server(launcher=None) as server:
            self.refused(server.dlcs("submit", wall(8), "--ranks", 2), "--ranks", "2; must be 0", "--mpi-launcher")
            capabilities = json.loads(server.dlcs("capabilities", "--format", "json").stdout)
            self.assertEqual(capabilities["jobs"].get("max_ranks", 0), 0)
        self.refused(run(DLCS, "solve", wall(8), "--ranks", 2), "--ranks", "2; must be 0")
        for analyze in (lambda *words: run(DLCS, *words), self.server.dlcs):
            self.refused(analyze("analyze", wall(8), "--ranks", 2), "--ranks", "2; must be 0", "or analyses")
        members = path("members.json")
        with open(members, "w", encoding="utf-8") as file:
            json.dump({"members": [{}]}, file)
        self.refused(self.server.dlcs("ensemble", wall(8), members, "--ranks", 2), "must be 0", "ensembles")

    def test_more_ranks_than_the_server_allows(self):
        with Server(flags=["--max-ranks", "2"]) as server:
            self.refused(server.dlcs("submit", wall(8), "--ranks", 3), "max_ranks", "3", "2", code=3)
            capabilities = json.loads(server.dlcs("capabilities", "--format", "json").stdout)
            self.assertEqual(capabilities["jobs"]["max_ranks"], 2)

    def test_settings_that_cannot_work_are_refused(self):
        def check(*flags):
            return run(DLCSD, "--store", path("none.db"), "--check-config", *flags)

        self.refused(check("--mpi-launcher", "no-such-mpirun -n {ranks}"), "no-such-mpirun", "PATH")
        self.refused(check("--mpi-launcher", f"{MPIRUN} -n 2"), "{ranks}")
        self.refused(check("--mpi-launcher", f"{MPIRUN} -n '{{ranks}}"), "quote")
        self.refused(check("--mpi-launcher", LAUNCHER, "--mpi-program", "/no/dlcs-mpi"), "--mpi-program /no/dlcs-mpi")
        self.refused(check("--max-ranks", "4"), "--max-ranks 4", "--mpi-launcher")
        self.refused(check("--mpi-patience-ms", "10"), "--mpi-patience-ms 10", "between 1000")

    # Requests to stop.

    def test_cancelled_in_its_steps(self):
        name = self.server.submit(wall(16), *LONG)
        ranks = self.server.ranks_at_work(name, progress=0)
        self.assertEqual(self.server.dlcs("cancel", name).returncode, 0)
        job = self.server.end(name, 10)
        self.assertEqual(job["state"], "JOB_STATE_CANCELLED")
        wait_until(lambda: not any(map(is_alive, ranks)), 5)
        summary = self.server.events(name)[-1]["summary"]
        self.assertEqual(summary["termination"], "TERMINATION_CANCELLED")
        # The part solved so far can be read.
        self.assertGreater(len(self.server.trajectory(name, code=3)["times"]), 1)

    def test_cancelled_while_it_is_set_up(self):
        # A solve with the nodes of a contour, which ranks factor without communication.
        options = ["--method", "laplace-iteration", "--propagator", "contour", "--steps", "200", "--at", "1"]
        name = self.server.submit(wall(24), *options)
        ranks = wait_until(lambda: len(found := self.server.ranks()) == 2 and found)
        time.sleep(1)
        self.server.dlcs("cancel", name)
        self.assertEqual(self.server.end(name, 15)["state"], "JOB_STATE_CANCELLED")
        wait_until(lambda: not any(map(is_alive, ranks)), 5)

    def test_groups_of_ranks_stop_after_a_node(self):
        with Server(launcher="env DLCS_MPI_RANKS_PER_GROUP=2 " + LAUNCHER) as server:
            options = ["--method", "laplace-iteration", "--propagator", "contour", "--steps", "200", "--at", "1"]
            name = server.submit(wall(8), *options)
            ranks = wait_until(lambda: len(found := server.ranks()) == 2 and found)
            time.sleep(1)
            server.dlcs("cancel", name)
            self.assertEqual(server.end(name, 15)["state"], "JOB_STATE_CANCELLED")
            wait_until(lambda: not any(map(is_alive, ranks)), 5)
            # It is the ranks that say so, where they were not ended.
            self.assertEqual(server.events(name)[-1]["summary"]["termination"], "TERMINATION_CANCELLED")

    def test_groups_that_do_not_divide_the_ranks_are_refused(self):
        with Server(launcher="env DLCS_MPI_RANKS_PER_GROUP=3 " + LAUNCHER) as server:
            job = server.end(server.submit(wall(8), *SOME))
            self.assertEqual(job["state"], "JOB_STATE_FAILED")
            self.assertIn("DLCS_MPI_RANKS_PER_GROUP 3: must divide the number of ranks, which is 2", str(job))

    def test_cancelled_where_ranks_hang(self):
        for hangs in (0, 1):
            name = self.server.submit(wall(16), *LONG)
            ranks = self.server.ranks_at_work(name, progress=0)
            os.kill(ranks[hangs], signal.SIGSTOP)
            self.server.dlcs("cancel", name)
            self.assertEqual(self.server.end(name, 20)["state"], "JOB_STATE_CANCELLED")
            wait_until(lambda ranks=ranks: not any(map(is_alive, ranks)), 5)

    def test_cancelled_before_a_rank_is_there(self):
        # As in the queue of a batch system.
        with Server(launcher=script("queue.sh", "sleep 1000\n") + " {ranks}") as server:
            name = server.submit(wall(16), *LONG)
            wait_until(lambda: server.job(name)["state"] == "JOB_STATE_RUNNING")
            sleeping = wait_until(lambda: [process for process, _ in descendants_of(server.process.pid)])
            server.dlcs("cancel", name)
            self.assertEqual(server.end(name, 15)["state"], "JOB_STATE_CANCELLED")
            self.assertFalse(any(map(is_alive, sleeping)))

    def test_a_deadline_gives_what_is_solved(self):
        # Neither the time in the queue was predicted, nor that others take four fifths of the processors.
        slowed = script("slowed.sh", "( while kill -STOP $$; do sleep 0.4; kill -CONT $$ || exit; sleep 0.1; done )"
                        " </dev/null >/dev/null 2>&1 &\nexec \"$@\"\n")  # fmt: skip
        late = script("late.sh", f"sleep 3\nshift\nexec {LAUNCHER.format(ranks=2)} {slowed} \"$@\"\n")
        with Server(launcher=f"{late} {{ranks}}") as server:
            # The diffusion is so fast that each step needs multigrid.
            slow = wall(16, coefficient=200)
            name = server.submit(slow, *STEPS, "--steps", "10000", "--at", "0:0.001:1", "--within", "15")
            job = server.end(name, 60)
            self.assertEqual(job["state"], "JOB_STATE_FAILED")
            self.assertIn("deadline", job["error"]["message"])
            self.assertEqual(server.events(name)[-1]["summary"]["termination"], "TERMINATION_DEADLINE")
            self.assertGreater(len(server.trajectory(name, code=3)["times"]), 1)

    # Killed processes.

    def resumes_after(self, kill):
        name = self.server.submit(wall(16), *SOME)
        ranks = self.server.ranks_at_work(name)
        kill(ranks)
        wait_until(lambda: not any(map(is_alive, ranks)), 5)
        self.succeeds_as_alone(self.server, name)
        self.was_resumed(self.server, name)

    def was_resumed(self, server, name, times=1):
        states = [event["state"] for event in server.events(name) if "state" in event]
        self.assertEqual(
            [state.removeprefix("JOB_STATE_") for state in states],
            [*(times * ["QUEUED", "RUNNING"]), "QUEUED", "RUNNING", "SUCCEEDED"],
        )

    def test_rank_0_killed(self):
        self.resumes_after(lambda ranks: os.kill(ranks[0], signal.SIGKILL))

    def test_rank_1_killed(self):
        self.resumes_after(lambda ranks: os.kill(ranks[1], signal.SIGKILL))
        self.assertIn("broke down", self.server.said())

    def test_the_launcher_killed(self):
        self.resumes_after(lambda _: os.kill(descendants_of(self.server.process.pid)[0][0], signal.SIGKILL))

    def test_resumed_between_jumps(self):
        # Where y jumps, the limits from both sides are stored.
        with open(wall(16), encoding="utf-8") as opened:
            problem = json.load(opened)
        problem["g"] = problem["N"]["rows"] * ["0.1 - 0.5*(t >= 0.2) + 0.5*(t >= 0.8)"]
        with open(path("jumps.json"), "w", encoding="utf-8") as file:
            json.dump(problem, file)
        options = [*STEPS, "--steps", "8000", "--at", "0,0.2,0.5,0.8,1"]
        name = self.server.submit(path("jumps.json"), *options)
        os.kill(self.server.ranks_at_work(name, progress=0.25)[1], signal.SIGKILL)
        self.assertEqual(self.server.end(name)["state"], "JOB_STATE_SUCCEEDED")
        self.was_resumed(self.server, name)
        found, expected = self.server.trajectory(name), alone(path("jumps.json"), *options)
        self.assertTrue(same(found, expected))
        self.assertEqual(found["left_limits"], expected["left_limits"])
        self.assertEqual(len(found["left_limits"]), 2)

    def test_windows_resume_too(self):
        options = ["--method", "laplace-iteration", "--propagator", "contour", "--no-estimate-error", "--window", "20"]
        options += ["--steps", "10000", "--at", "0:0.1:1"]
        name = self.server.submit(wall(8), *options)
        os.kill(self.server.ranks_at_work(name)[0], signal.SIGKILL)
        self.assertEqual(self.server.end(name)["state"], "JOB_STATE_SUCCEEDED")
        self.was_resumed(self.server, name)
        self.assertTrue(same(self.server.trajectory(name), alone(wall(8), *options)))

    def test_ranks_that_hang_are_lost(self):
        # While one rank hangs, the other one waits for it in MPI, and neither ends. A launcher lets ranks run for three
        # seconds after SIGTERM, so the solve must last longer than that: each step needs multigrid.
        slow = wall(16, coefficient=200)
        options = [*STEPS, "--steps", "8000", "--at", "0:0.1:1"]
        with Server(flags=["--mpi-patience-ms", "5000"]) as server:
            name = server.submit(slow, *options)
            progress = 0
            for hanging in (1, 0):
                ranks = server.ranks_at_work(name, progress + 0.05)
                os.kill(ranks[hanging], signal.SIGSTOP)
                wait_until(lambda: f"broke down: rank {hanging} was lost first" in server.said(), 30)
                self.assertFalse(any(map(is_alive, ranks)))
                progress = server.job(name)["progress"]
            self.assertEqual(server.end(name, 180)["state"], "JOB_STATE_SUCCEEDED")
            self.assertTrue(same(server.trajectory(name), alone(slow, *options)))
            self.was_resumed(server, name, times=2)

    def test_the_worker_killed(self):
        first = Server()
        try:
            name = first.submit(wall(16), *SOME)
            ranks = first.ranks_at_work(name)
        finally:
            first.process.kill()
            first.process.wait()
            first.process.stdout.close()
        wait_until(lambda: not any(map(is_alive, ranks)), 20)
        with Server(store=first.store) as second:
            self.succeeds_as_alone(second, name)

    def test_a_worker_that_shuts_down_gives_the_job_back(self):
        with Server() as first:
            name = first.submit(wall(16), *SOME)
            ranks = first.ranks_at_work(name)
        self.assertFalse(any(map(is_alive, ranks)))
        # A server without a launcher leaves the job to one that has a launcher, and reports that.
        with Server(launcher=None, store=first.store) as other:
            without = other.submit(wall(8), *STEPS, "--steps", "10", ranks=0)
            self.assertEqual(other.end(without)["state"], "JOB_STATE_SUCCEEDED")
            job = other.job(name)
            self.assertEqual((job["state"], job["attempts"]), ("JOB_STATE_QUEUED", 0))
            self.assertIn("a server that starts 2 ranks", job["waiting_for"])
            self.assertIn("waits for  a server that starts 2 ranks", other.dlcs("get", name).stdout)
        with Server(store=first.store) as second:
            self.assertGreater(second.job(name)["progress"], 0)
            self.assertEqual(second.job(name)["waiting_for"], "")
            self.succeeds_as_alone(second, name)

    def test_ranks_that_always_die_end_the_job(self):
        dies = script("dies.sh", "sh -c 'kill -9 $$'\nexit 137\n")
        with Server(launcher=f"{dies} {{ranks}}", flags=["--max-job-attempts", "3"]) as server:
            job = server.end(server.submit(wall(16), *SOME))
            self.assertEqual(job["state"], "JOB_STATE_FAILED")
            self.assertIn("3 times without progress", job["error"]["message"])

    # Wrong launchers, and callers that are not ranks of the attempt.

    def fails(self, launcher, *words):
        with Server(launcher=launcher) as server:
            name = server.submit(wall(16), *SOME)
            job = server.end(name)
            self.assertEqual(job["state"], "JOB_STATE_FAILED")
            for word in words:
                self.assertIn(word, job["error"]["message"])
            self.assertEqual(job["attempts"], 1)
            return server.said()

    def test_a_launcher_that_starts_singletons(self):
        # As srun without --mpi=pmix does.
        singletons = script("singletons.sh", 'shift\n"$@" &\n"$@" &\nwait\n')
        self.fails(f"{singletons} {{ranks}}", "was not requested", "1 rank, and 2 were promised")

    def test_a_launcher_that_starts_fewer(self):
        self.fails(LAUNCHER.replace("{ranks}", "1") + " -x RANKS={ranks}", "was not requested", "1 rank")

    def test_a_launcher_that_refuses(self):
        refuses = script("refuses.sh", "echo no such partition\necho 'ask for less' >&2\nexit 1\n")
        self.fails(f"{refuses} {{ranks}}", "exit code 1", "no such partition / ask for less")

    def test_a_launcher_that_vanishes(self):
        launcher = script("vanishes.sh", "exit 1\n")
        with Server(launcher=f"{launcher} {{ranks}}") as server:
            os.remove(launcher)
            job = server.end(server.submit(wall(16), *SOME))
            self.assertEqual(job["state"], "JOB_STATE_FAILED")
            self.assertIn("vanishes.sh", job["error"]["message"])

    def test_a_launcher_that_talks(self):
        talks = script("talks.sh", "yes 'this is \033[31mno\033[0m protocol' | head -1000\nshift\n" +
                       f"exec {LAUNCHER.format(ranks=2)} \"$@\"\n")
        with Server(launcher=f"{talks} {{ranks}}") as server:
            self.succeeds_as_alone(server, server.submit(wall(16), *SOME))
            self.assertIn("ranks: this is ?[31mno?[0m protocol", server.said())

    def test_a_launcher_that_passes_no_variables(self):
        # As mpirun does to other machines without -x.
        forgets = script("forgets.sh", "shift\nunset DLCS_MPI_WORKER DLCS_MPI_SECRET\n" +
                         f"exec {LAUNCHER.format(ranks=2)} \"$@\"\n")
        self.fails(f"{forgets} {{ranks}}", "has no DLCS_MPI_WORKER", "-x DLCS_MPI_SECRET")
        # The others are not needed for the result.
        one = "--allow-run-as-root --oversubscribe --bind-to none -n 1"
        half = script("half.sh", f"shift\nexec {MPIRUN} {one} \"$@\" : -n 1 env -u DLCS_MPI_WORKER \"$@\"\n")
        with Server(launcher=f"{half} {{ranks}}") as server:
            self.succeeds_as_alone(server, server.submit(wall(16), *SOME))
            self.assertIn("rank 1 has no DLCS_MPI_WORKER", server.said())

    def test_strangers_get_nothing(self):
        name = self.server.submit(wall(16), *LONG)
        first = self.server.ranks_at_work(name, progress=0)[0]
        worker, secret = (variable_of(first, f"DLCS_MPI_{what}") for what in ("WORKER", "SECRET"))
        attend = [DLCS_MPI, "--ranks", "1", "attend"]
        wrong = run(*attend, DLCS_MPI_WORKER=worker, DLCS_MPI_SECRET="a" * len(secret))
        self.refused(wrong, "not the secret", code=3)
        self.refused(run(*attend, DLCS_MPI_WORKER=worker), "not the secret", code=3)
        again = run(*attend, DLCS_MPI_WORKER=worker, DLCS_MPI_SECRET=secret)
        self.refused(again, "already here", code=3)
        self.assertIn("without the secret", self.server.said())
        # The ranks continue undisturbed.
        progress = self.server.job(name)["progress"]
        wait_until(lambda: self.server.job(name)["progress"] > progress)
        self.server.dlcs("cancel", name)
        self.assertEqual(self.server.end(name, 10)["state"], "JOB_STATE_CANCELLED")
        after = run(*attend, DLCS_MPI_WORKER=worker, DLCS_MPI_SECRET=secret)
        self.refused(after, "no work from the worker", code=3)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[5:])
