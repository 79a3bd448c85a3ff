#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The Python package in the hands of strangers: every mistake is a dlcs.Error that names the argument, and threads,
forks, signals and deaths leave nothing behind.

    python_misuse_test.py DLCSD SOURCE_FOLDER
"""

import asyncio
import copy
import math
import os
import pathlib
import pickle
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import scipy.sparse as sparse

DLCSD, SOURCE = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
PACKAGE = SOURCE / "client/python/src"
os.environ["DLCSD"] = str(DLCSD)
os.environ.pop("DLCS_SERVER", None)
sys.path.insert(0, str(PACKAGE))

import dlcs  # noqa: E402
from dlcs.private_server import private_server  # noqa: E402

DECAY = {"A": [[-1]], "B": [[0]], "N": [[0]], "M": [[1]], "x0": [1], "t_span": (0, 1)}
NAN, INF = math.nan, math.inf


def fails(error):
    def function(t):
        raise error

    return function


class Unshowable:
    def __repr__(self):
        raise RuntimeError("has no text")


class ArgumentsTest(unittest.TestCase):
    # The field that the error names: its values.
    REFUSED = {
        "A": (None, "text", {}, object(), Unshowable(), [["1"]], [[1], [2, 3]], [[[1]]], [[1, 2]], [[10**400]], [])
        + (np.array([["2020-01-01"]], dtype="datetime64[D]"), np.ma.masked_array([[1.0]], mask=[[True]]))
        + (sparse.csr_matrix([[1j]]), sparse.csr_matrix((2, 2)), np.broadcast_to(0.0, (40_000, 40_000))),
        "M": ([], [[]], np.zeros((0, 0)), sparse.csr_matrix((0, 0))),
        "x0": (None, "1", [], [[1]], [1j]),
        "E": ("text", [], [[1, 2]], [[1j]]),
        "t_span": (None, 5, "01", ("a", "b"), (0, 1, 2), (1, 0), (0, 0), (0, NAN), (-INF, 0), [(0, 1)]),
        "t_eval": ([], "abc", [[0, 1]], [NAN], [0.5, 0.5], [-1, 0.5], [2]),
        "breaks": (None, ["a"], [NAN], [[0.5]]),
        "f": (lambda t: None, lambda t: "sin(t)", lambda t: [1, 2], lambda t: [NAN], lambda: [1], [[1], [2, 3]])
        + (fails(KeyError("k")), fails(ZeroDivisionError()), fails(MemoryError()), ["0", "0"], [[1]], []),
        "f[0]": ({"a": 1}, {1}, b"sin(t)", [1j], [None], [10**400], (0 for _ in range(1)), [math.sin]),
        "tol": (0, -1, NAN, INF, "1e-6", [1e-6], object()),
        "atol": (-1, NAN, INF, "1e-6", [1e-6], object()),
        "rule": (5, "biggest", b"unique"),
        "title": (None, 5),
        "steps": (1.5, 2**70, None, "many", [1]),
        "method": (None, 1.5, "magic"),
        "grid_times": ("abc", [[0, 1]], None),
        "output_times": ([0.5],),
        "stepz": (1,),
        "server": (5, ["x"], "junk", "localhost:", "localhost:99999", "localhost:٣"),
        "token": (5, "two\nlines", "ü"),
        "ca": ("/no/such/file", "/", "/etc/passwd", 5.5, "nul\0"),
        "timeout": (0, -1, NAN, INF, "x", [1]),
        "dlcsd": (5, ["dlcsd"]),
    }

    def test_are_refused_by_their_names(self):
        for field, values in self.REFUSED.items():
            for value in values:
                argument = field.partition("[")[0]
                with self.subTest(field, value=type(value).__name__):
                    with self.assertRaises(dlcs.InvalidArgument) as raised:
                        dlcs.solve(**(DECAY | {argument: value}))
                    self.assertEqual([v.field for v in raised.exception.violations], [field], raised.exception)
                    self.assertLess(len(str(raised.exception)), 300)

    def test_say_what_was_meant(self):
        for given, message in (({"rtol": 1e-3, "tol": 1e-3}, "rtol: is another name of tol; give one of them"),
                               ({"atol": {"x9": 1}}, '"x9"; is no state, pair or output of the problem, which has x1'),
                               ({"atol": {"x1": -1}}, "atol['x1']: -1; must be a number at least 0"),
                               ({"tol": "1e-6"}, "tol: '1e-6'; must be a positive number")):  # fmt: skip
            with self.assertRaisesRegex(dlcs.InvalidArgument, re.escape(message)):
                dlcs.solve(**(DECAY | given))

    def test_that_disagree_are_named_together(self):
        with self.assertRaisesRegex(dlcs.InvalidArgument, "A: is 1 x 1; must be 2 x 2, since x0 has 2 values"):
            dlcs.solve(**(DECAY | {"x0": [1, 2]}))

    def test_that_are_not_finite_are_refused_by_the_server(self):
        for argument, field in (("A", "problem.a[0][0]"), ("x0", "problem.x0[0]"), ("f", "problem.f[0]")):
            value = [[NAN]] if argument == "A" else [NAN]
            with self.assertRaises(dlcs.InvalidArgument) as raised:
                dlcs.solve(**(DECAY | {argument: value}))
            self.assertEqual(raised.exception.violations[0].field, field)

    def test_of_any_numeric_type_give_the_same_bits(self):
        expected = dlcs.solve(**DECAY, f=[2.0], t_eval=[0.5, 1]).x
        for matrix in (np.array([[-1]], dtype=np.int8), np.asfortranarray([[-1.0]]), np.array([[-1]], dtype=object),
                       sparse.coo_matrix([[-1.0]]), sparse.dia_array([[-1.0]]), [-1]):  # fmt: skip
            for source in (2, [2], "2", ["2.0"], np.array(2), np.array([2], dtype=np.float32), np.array(["2"])):
                sol = dlcs.solve(**(DECAY | {"A": matrix, "t_span": np.array([0, 1])}), f=source, t_eval=(0.5, 1))
                np.testing.assert_array_equal(sol.x, expected)

    def test_are_not_changed(self):
        matrix = sparse.coo_matrix(([-3.0, 2.0], ([0, 0], [0, 0])), (1, 1))  # an entry in two parts
        sol = dlcs.solve(**(DECAY | {"A": matrix}), t_eval=[1])
        self.assertAlmostEqual(sol.x[0, 0], math.exp(-1), delta=1e-6)
        self.assertEqual(matrix.nnz, 2)

    def test_the_cause_of_a_failing_function_is_kept(self):
        with self.assertRaisesRegex(dlcs.InvalidArgument, "f: fails at t = 0.0: KeyError: 'k'") as raised:
            dlcs.solve(**DECAY, f=fails(KeyError("k")))
        self.assertIsInstance(raised.exception.__cause__, KeyError)
        with self.assertRaises(KeyboardInterrupt):
            dlcs.solve(**DECAY, f=fails(KeyboardInterrupt()))

    def test_grid_times_are_those_of_the_span(self):
        sol = dlcs.solve(**(DECAY | {"t_span": (5, 6)}), grid_times=[5, 5.25, 6], estimate_error=False)
        np.testing.assert_array_equal(sol.t, [5, 5.25, 6])

    def test_of_other_calls_are_refused_by_their_names(self):
        with dlcs.Client() as client:
            for call, field in (
                (lambda: client.job(5), "name"),
                (lambda: client.cancel(None), "name"),
                (lambda: client.delete(b"jobs/x"), "name"),
                (lambda: client.watch("jobs/x", after="1"), "after"),
                (lambda: client.submit(**DECAY, request_id=5), "request_id"),
                (lambda: client.submit(**DECAY, priority=2**40), "priority"),
                (lambda: client.submit(**DECAY, priority=0.5), "priority"),
            ):
                with self.assertRaises(dlcs.InvalidArgument) as raised:
                    call()
                self.assertEqual(raised.exception.violations[0].field, field)


class SolutionTest(unittest.TestCase):
    def test_refuses_times_that_are_none(self):
        sol = dlcs.solve(**DECAY, t_eval=[0, 1])
        for t in (None, "0.5", NAN, [NAN], INF, 1j, [[0.2, 0.3]], -0.1, 1.1, [0.5, 2], object(), [[0.1], [0.2, 0.3]]):
            with self.subTest(t=str(t)), self.assertRaises(dlcs.InvalidArgument) as raised:
                sol(t)
            self.assertEqual(raised.exception.violations[0].field, "t")
        self.assertEqual(sol([]).shape, (1, 0))
        self.assertEqual(sol([0.7, 0.2, 0.7]).shape, (1, 3))

    def test_that_ended_early_says_so_beyond_its_end(self):
        sol = dlcs.solve([[0]], [[1]], [[1]], [[0]], f=[-1], x0=[-1], t_span=(0, 1))
        self.assertFalse(sol.success)
        with self.assertRaisesRegex(dlcs.InvalidArgument, "ends before"):
            sol(0.5)

    def test_can_be_copied_and_sent(self):
        sol = dlcs.solve(**DECAY)
        for other in (copy.deepcopy(sol), pickle.loads(pickle.dumps(sol))):
            np.testing.assert_array_equal(other.x, sol.x)
            self.assertEqual(other.certificate, sol.certificate)
            self.assertEqual((other.message, other.error), (sol.message, sol.error))
            np.testing.assert_array_equal(other(sol.t[1]), sol.x[:, 1])
            with self.assertRaisesRegex(dlcs.InvalidArgument, "not at hand"):
                other(0.123456)

    def test_of_an_iteration_is_there_at_its_end(self):
        run = dlcs.iterate(**DECAY, steps=100, method="laplace-iteration")
        next(iter(run))
        with self.assertRaisesRegex(dlcs.FailedPrecondition, "before the last iterate"):
            run.solution

    def test_of_a_closed_client_says_so(self):
        with dlcs.Client() as client:
            sol = client.solve(**DECAY)
        client.close()
        for call in (lambda: sol(0.1234567), client.capabilities, lambda: client.solve(**DECAY)):
            with self.assertRaisesRegex(dlcs.FailedPrecondition, "closed"):
                call()


class AsyncioTest(unittest.TestCase):
    def test_a_client_may_be_made_outside_a_loop_and_used_in_several(self):
        client = dlcs.aio.Client()
        solutions = [asyncio.run(client.solve(**DECAY)) for _ in range(2)]
        np.testing.assert_array_equal(solutions[0].x, solutions[1].x)

        async def close():
            await solutions[1](0.1234567)
            await client.close()
            with self.assertRaisesRegex(dlcs.FailedPrecondition, "closed"):
                await solutions[1](0.1234567)

        asyncio.run(close())

    def test_a_task_can_be_cancelled(self):
        async def run():
            async with dlcs.aio.Client() as client:
                task = asyncio.create_task(client.solve(**LONG))
                await asyncio.sleep(0.3)
                self.assertFalse(task.done())
                task.cancel()
                with self.assertRaises(asyncio.CancelledError):
                    await task
                self.assertTrue((await client.solve(**DECAY)).success)

        asyncio.run(run())


# Takes minutes.
LONG = DECAY | {"A": [[-1, 1], [0, -1]], "B": [[1], [0]], "N": [[1, 0]], "x0": [1, 1], "f": ["sin(9*t)", "1"]}
LONG |= {"steps": 4_000_000, "method": "laplace-iteration", "t_span": (0, 1000), "t_eval": [1000]}


def decay(rate):
    return dlcs.solve(**(DECAY | {"A": [[-rate]]}), t_eval=[1])


def program(text, *arguments, **options):
    """A process that runs `text` with the package."""
    head = f"import sys; sys.path.insert(0, {str(PACKAGE)!r}); import dlcs, os, signal, threading, time\n"
    head += f"DECAY, LONG = {DECAY!r}, {LONG!r}\n"
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen([sys.executable, "-c", head + text, *arguments], text=True, **pipes, **options)


class ProcessesTest(unittest.TestCase):
    def finish(self, process, seconds=60):
        out, err = process.communicate(timeout=seconds)
        self.assertEqual(process.returncode, 0, err)
        return out

    def test_threads_share_one_server(self):
        with ThreadPoolExecutor(8) as pool:
            found = [float(sol.x[0, 0]) for sol in pool.map(decay, range(40))]
            self.assertEqual(len(set(pool.map(lambda _: private_server(), range(40)))), 1)
        np.testing.assert_allclose(found, np.exp(-np.arange(40.0)), rtol=0, atol=1e-6)

    def test_processes_that_are_spawned_solve_and_return_solutions(self):
        decay(1)
        with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
            found = [float(sol.x[0, 0]) for sol in pool.map(decay, range(4), timeout=60)]
        np.testing.assert_allclose(found, np.exp(-np.arange(4.0)), rtol=0, atol=1e-6)

    def test_processes_that_are_forked_before_the_first_call_solve(self):
        process = program("""
child = os.fork()
assert dlcs.solve(**DECAY).success
if child:
    assert os.waitpid(child, 0)[1] == 0
    print("parent")
""")
        self.assertEqual(self.finish(process), "parent\n")

    def test_processes_that_are_forked_later_are_told_so(self):
        process = program("""
client = dlcs.Client()
run = iter(client.iterate(**DECAY, steps=1000, method="laplace-iteration"))
next(run)
child = os.fork()
if child:
    assert os.waitpid(child, 0)[1] == 0
    list(run)
    assert client.solve(**DECAY).success
    print("parent")
else:
    for solve in (dlcs.solve, client.solve):
        try:
            solve(**DECAY)
            os._exit(1)
        except dlcs.FailedPrecondition as error:
            if "forked" not in str(error):
                os._exit(2)
    os._exit(0)
""")
        self.assertEqual(self.finish(process), "parent\n")

    def test_ctrl_c_ends_the_solve_and_not_the_server(self):
        process = program("""
address = dlcs.Client()._connection.server
print(flush=True)
try:
    dlcs.solve(**LONG)
except KeyboardInterrupt:
    begin = time.monotonic()
    assert dlcs.solve(**DECAY).success
    assert dlcs.Client()._connection.server == address
    print("goes on")
""", start_new_session=True)
        process.stdout.readline()
        time.sleep(1)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to all of its processes
        self.assertEqual(self.finish(process), "goes on\n")

    def test_ctrl_c_at_any_moment_leaves_no_lock_behind(self):
        process = program("""
client = dlcs.Client()
for i in range(40):
    threading.Timer(0.1 + 0.003 * i, os.kill, (os.getpid(), signal.SIGINT)).start()
    try:
        client.solve(**LONG)
    except KeyboardInterrupt:
        assert client.solve(**DECAY).success
print("goes on")
""")
        self.assertEqual(self.finish(process, seconds=120), "goes on\n")

    def test_a_server_that_died_is_started_again(self):
        process = program("""
from dlcs import private_server
dlcs.solve(**DECAY)
for server in private_server._servers.values():
    os.kill(server._process.pid, signal.SIGKILL)
    server._process.wait()
assert dlcs.solve(**DECAY).success
""")
        self.finish(process)

    def test_a_program_that_is_no_dlcsd_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            for text, word in (("echo hello; sleep 600", "is not a dlcsd"), ("echo >&2 broken; exit 3", "broken")):
                script = pathlib.Path(folder) / "dlcsd"
                script.write_text(f"#!/bin/sh\n{text}\n")
                script.chmod(0o700)
                with self.assertRaisesRegex(dlcs.Unavailable, word):
                    dlcs.Client(dlcsd=str(script))

    def test_folders_of_killed_processes_are_removed_by_the_next(self):
        wait = "print(dlcs.Client()._connection.server, flush=True); time.sleep(600)"
        with tempfile.TemporaryDirectory() as folder:
            environment = os.environ | {"TMPDIR": folder}
            stranger = pathlib.Path(folder) / "dlcs-private-of-another-program"
            stranger.mkdir()
            processes = [program(wait, env=environment) for _ in range(3)]
            folders = [pathlib.Path(p.stdout.readline().strip().removeprefix("unix:")).parent for p in processes]
            for process in processes[:2]:
                process.kill()
                process.wait(timeout=30)
            self.assertTrue(all(path.exists() for path in folders))
            self.finish(program("assert dlcs.solve(**DECAY).success", env=environment))
            self.assertEqual([path.exists() for path in folders], [False, False, True])
            self.assertTrue(stranger.exists())
            processes[2].send_signal(signal.SIGINT)
            processes[2].wait(timeout=30)
            self.assertEqual(list(pathlib.Path(folder).iterdir()), [stranger])
            for process in processes:
                process.stdout.close()
                process.stderr.close()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
