#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The Python package against a real dlcsd.

Usage: python_client_test.py DLCSD DLCS SOURCE_FOLDER
"""

import asyncio
import json
import math
import os
import pathlib
import signal
import stat
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from socket import create_server

import numpy as np

DLCSD, DLCS, SOURCE = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
os.environ["DLCSD"] = DLCSD
os.environ.pop("DLCS_SERVER", None)
sys.path.insert(0, str(SOURCE / "client/python/src"))

import dlcs  # noqa: E402
from dlcs import messages  # noqa: E402

A = [[-1, 0], [0, -2]]
B = [[-3, 0, 0, 3], [0, 1.3, 1.3, 0]]
N = [[-1, 0], [0, 1], [0, 1], [1, 0]]
M = [[1, 0, 0, 0], [0, 0, -1, 0], [0, -1, 0, 0], [0, 0, 0, 1]]
FOUR_ONE = {"A": A, "B": B, "N": N, "M": M, "x0": [0, 1], "t_span": (0, 1)}


def exact(t):
    t = np.asarray(t)
    x1 = (4.8 * np.sin(10 * t) - 12 * np.cos(10 * t)) / 116 + 3 / 29 * np.exp(-4 * t)
    return np.array([x1, np.exp(-2 * t)])


class SolveTest(unittest.TestCase):
    """With the private server of this process."""

    def test_meets_the_tolerance_at_nodes_and_between_them(self):
        for tol in (1e-4, 1e-8, 1e-11):
            sol = dlcs.solve(**FOUR_ONE, f=["1.2*sin(10*t)", "0"], tol=tol)
            self.assertTrue(sol.success, sol.message)
            self.assertEqual(sol.status, 0)
            self.assertEqual((sol.x.shape[0], sol.y.shape[0], sol.w.shape), (2, 4, sol.y.shape))
            self.assertEqual(sol.x.shape[1], sol.t.size)
            size = np.abs(sol.x).max(axis=1)
            self.assertLessEqual((np.abs(sol.x - exact(sol.t)).max(axis=1) / size).max(), tol)
            times = np.random.default_rng(1).uniform(0, 1, 50)
            self.assertLessEqual((np.abs(sol(times) - exact(times)).max(axis=1) / size).max(), tol)
            self.assertEqual(sol(0.5).shape, (2,))
            np.testing.assert_array_equal(sol.sol(times), sol(times))  # as a result of solve_ivp

    def test_solutions_satisfy_the_complementarity_conditions(self):
        sol = dlcs.solve(**FOUR_ONE, f=["1.2*sin(10*t)", "0"])
        self.assertGreaterEqual(sol.y.min(), 0)
        self.assertGreaterEqual(sol.w.min(), -1e-12)
        self.assertLess(np.abs(sol.y * sol.w).max(), 1e-12)
        np.testing.assert_allclose(sol.w, np.array(N) @ sol.x + np.array(M) @ sol.y, atol=1e-9)
        self.assertEqual(sol.t_events[0], 0)
        self.assertGreater(sol.t_events.size, 1)

    def test_takes_tolerances_as_scipy_does(self):
        # z follows the difference of two states that are equal but for 1e-9: of 1e-9 of z, rounding leaves nothing.
        system = {
            "A": [[-1, 0, 0], [0, -1, 0], [1e3, -1e3, -1]], "B": np.zeros((3, 1)), "N": np.zeros((1, 3)), "M": [[1]],
            "f": ["sin(t)", "sin(t)", 0], "g": [1], "x0": [1, 1 + 1e-9, 0], "t_span": (0, 5),
            "outputs": {"difference": ([1, -1, 0], [0])},
        }  # fmt: skip
        self.assertFalse(dlcs.solve(**system, rtol=1e-8).success)
        for atol in (1e-9, {"x3": 1e-9, "difference": 1e-12}, {"x3": np.float32(1e-9)}):
            sol = dlcs.solve(**system, rtol=1e-8, atol=atol)
            self.assertTrue(sol.success, sol.message)
            self.assertEqual(sol.summary.accuracy.tolerance, 1e-8)
        self.assertFalse(dlcs.solve(**system, rtol=1e-8, atol={"x1": 1e-9}).success)
        np.testing.assert_array_equal(dlcs.solve(**system, rtol=1e-8, t_eval=[5]).x,
                                      dlcs.solve(**system, tol=1e-8, t_eval=[5]).x)  # fmt: skip

    def test_finds_the_periodic_steady_state(self):
        # x' = -x/100 + sin 3t, and a pair that does nothing.
        period = 2 * math.pi / 3
        system = {"A": [[-0.01]], "B": [[0]], "N": [[0]], "M": [[1]], "f": ["sin(3*t)"], "g": [1], "x0": [5]}
        times = np.linspace(0, period, 7)
        sol = dlcs.solve(**system, t_span=(0, 10), period=period, t_eval=times, tol=1e-9)
        self.assertTrue(sol.success, sol.message)
        exact_x = (0.01 * np.sin(3 * times) - 3 * np.cos(3 * times)) / (0.01**2 + 9)
        np.testing.assert_allclose(sol.x[0], exact_x, atol=1e-9)
        periodic = sol.summary.periodic
        self.assertAlmostEqual(periodic.multipliers[0].real, math.exp(-0.01 * period), 12)
        self.assertAlmostEqual(periodic.mean_x[0], 0, 8)
        self.assertAlmostEqual(1 + periodic.growth, math.exp(-0.01 * period), 12)
        self.assertNotIn("stable", sol.message)
        # Backwards in time it is unstable.
        unstable = dlcs.solve(**(system | {"A": [[0.01]]}), t_span=(0, 10), period=period, tol=1e-9)
        self.assertFalse(unstable.success)
        self.assertIn("unstable: disturbances grow by 2.1 % a period", unstable.message)
        self.assertAlmostEqual(unstable.summary.periodic.growth, math.expm1(0.01 * period), 12)
        with self.assertRaisesRegex(dlcs.InvalidArgument, "period of every source"):
            dlcs.solve(**system, t_span=(0, 10), period=2)

    def test_fits_callables(self):
        for tol in (1e-5, 1e-9):
            sol = dlcs.solve(**FOUR_ONE, f=lambda t: [1.2 * math.sin(10 * t), 0], tol=tol)
            self.assertLessEqual(np.abs(sol.x - exact(sol.t)).max(), tol)

    def test_a_span_may_begin_anywhere(self):
        sol = dlcs.solve(
            **(FOUR_ONE | {"t_span": (5, 6)}),
            f=lambda t: [1.2 * math.sin(10 * (t - 5)), 0],
            t_eval=[5, 5.1, 5.3, 6],
            tol=1e-9,
        )
        np.testing.assert_array_equal(sol.t, [5, 5.1, 5.3, 6])
        self.assertLessEqual(np.abs(sol.x - exact(sol.t - 5)).max(), 1e-9)
        with self.assertRaisesRegex(dlcs.InvalidArgument, "t_span"):
            dlcs.solve(**(FOUR_ONE | {"t_span": (5, 6)}), f=["sin(t)", "0"])

    def test_reports_where_a_callable_is_not_resolved(self):
        def step(t):
            return [float(t >= 0.3)]

        one = {"A": [[-1]], "B": [[0]], "N": [[0]], "M": [[1]], "x0": [0], "t_span": (0, 1)}
        with self.assertRaisesRegex(dlcs.InvalidArgument, r"f: is not resolved near t = 0\.(3000|2999)") as caught:
            dlcs.solve(**one, f=step)
        self.assertEqual([violation.field for violation in caught.exception.violations], ["f"])
        sol = dlcs.solve(**one, f=step, breaks=[0.3], tol=1e-9)
        self.assertLess(abs(sol.x[0, -1] - (1 - math.exp(-0.7))), 1e-9)
        for bad, word in ((lambda t: [1, 2], "shape"), (lambda t: [math.nan], "must be finite")):
            with self.assertRaisesRegex(dlcs.InvalidArgument, word):
                dlcs.solve(**one, f=bad)

    def test_takes_sparse_matrices(self):
        import scipy.sparse

        sparse = {name: scipy.sparse.csr_matrix(np.array(FOUR_ONE[name], dtype=float)) for name in "ABNM"}
        one = dlcs.solve(**(FOUR_ONE | sparse), f=["1.2*sin(10*t)", "0"], steps=200)
        two = dlcs.solve(**FOUR_ONE, f=["1.2*sin(10*t)", "0"], steps=200)
        np.testing.assert_allclose(one.x, two.x, rtol=0, atol=1e-12)

    def test_takes_a_mass_matrix(self):
        import scipy.sparse

        mass = np.array([[2.0, 0.5], [0.5, 1.0]])
        f = np.array([0.3, -0.1])
        weighted = FOUR_ONE | {name: mass @ np.array(FOUR_ONE[name], dtype=float) for name in "AB"}
        plain = dlcs.solve(**FOUR_ONE, f=f, tol=1e-9)
        for E in (mass, scipy.sparse.csr_matrix(mass)):
            sol = dlcs.solve(**weighted, E=E, f=mass @ f, tol=1e-9)
            np.testing.assert_allclose(sol.x[:, -1], plain.x[:, -1], rtol=0, atol=1e-8)
        with self.assertRaisesRegex(dlcs.InvalidArgument, "rows 0 and 1 depend on each other"):
            dlcs.solve(**weighted, E=[[1, 2], [2, 4]], f=f)

    def test_no_solution_is_no_exception(self):
        sol = dlcs.solve([[0]], [[1]], [[1]], [[0]], f=[-1], x0=[-1], t_span=(0, 1))
        self.assertFalse(sol.success)
        self.assertEqual(sol.status, -1)
        self.assertRegex(sol.message, "not solved")

    def test_bad_input_names_the_field_and_the_rule(self):
        for change, field in (
            ({"N": [[1, 0]]}, "N"),
            ({"B": [[1]]}, "B"),
            ({"x0": [1, 2, 3]}, "A"),
            ({"f": ["0"]}, "f"),
            ({"t_span": (1, 0)}, "t_span"),
            ({"t_eval": [0.5, 0.5]}, "t_eval"),
            ({"t_eval": [0.5, 2]}, "t_eval"),
            ({"rule": "biggest"}, "rule"),
            ({"method": "magic"}, "method"),
            ({"stepz": 3}, "stepz"),
            ({"steps": "many"}, "steps"),
            ({"theta": 3, "steps": 10, "method": "time-stepping"}, "options.theta"),
            ({"f": ["sin(", "0"]}, "problem.f[0]"),
            ({"tol": 2}, "options.error_tolerance"),
            ({"tol": "small"}, "tol"),
            ({"A": "text"}, "A"),
            ({"A": [[1, 2], [3]]}, "A"),
            ({"A": [[1j, 0], [0, 1]]}, "A"),
            ({"x0": []}, "x0"),
            ({"t_eval": []}, "t_eval"),
            ({"f": [math.sin, 0]}, "f[0]"),
            ({"f": [[1], [2]]}, "f"),
            ({"f": lambda t: ["a", "b"]}, "f"),
            ({"contour": 3}, "contour"),
        ):
            with self.assertRaises(dlcs.InvalidArgument, msg=str(change)) as raised:
                dlcs.solve(**(FOUR_ONE | change))
            self.assertEqual(raised.exception.code, "INVALID_ARGUMENT")
            self.assertEqual(raised.exception.violations[0].field, field, raised.exception)
            self.assertTrue(raised.exception.violations[0].description)

    def test_yields_iterates(self):
        run = dlcs.iterate(**FOUR_ONE, f=["1.2*sin(10*t)", "0"], steps=1000, method="laplace-iteration")
        changes = [iterate.change for iterate in run]
        self.assertGreater(len(changes), 5)
        self.assertLess(changes[-1], 1e-9)
        self.assertTrue(run.solution.success)


DECK = """a resistor charges a capacitor
V1 in 0 10
R1 in out 1k
C1 out 0 1u IC=0
.tran 1u 4m uic
.print tran v(out) {v(in)-v(out)}
.meas tran t63 WHEN V(out)=5
.meas tran never WHEN V(out)=11
"""


class OutputsTest(unittest.TestCase):
    def test_outputs_have_names_and_limits_from_both_sides(self):
        outputs = {"sum": ([1, 1], [0, 0, 0, 1]), "wave": (None, None, "3*(t<0.5)+t")}
        sol = dlcs.solve(**FOUR_ONE, f=["1.2*sin(10*t)", "0"], outputs=outputs)
        self.assertEqual(list(sol.outputs), ["sum", "wave"])
        np.testing.assert_allclose(sol.outputs["sum"], sol.x.sum(axis=0) + sol.y[3], atol=1e-12)
        np.testing.assert_allclose(sol.outputs["wave"], 3 * (sol.t < 0.5) + sol.t)
        self.assertIn(0.5, [time for time, _, _ in sol.left_limits])
        self.assertEqual(dlcs.solve(**FOUR_ONE).outputs, {})

    def test_wrong_outputs_are_refused_by_name(self):
        for outputs, words in (
            ({"a": ([1],)}, "row of 1; must have 2"),
            ({"a": 3}, "must be \\(row over x"),
            (["a"], "must be a dictionary"),
            ({"": ([1, 1],)}, "outputs.names"),
            ({"a": (None, None, "t+")}, "outputs"),
        ):
            with self.assertRaisesRegex(dlcs.InvalidArgument, words):
                dlcs.solve(**FOUR_ONE, outputs=outputs)

    def test_a_deck_is_a_problem(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "-charger.cir"
            path.write_text(DECK)
            problem = dlcs.read_deck(path, dlcs=DLCS)
            self.assertIn("a resistor charges", repr(problem))
            sol = dlcs.solve(problem, tol=1e-9, t_eval=[0.001, 0.004])
            np.testing.assert_allclose(sol.outputs["v(out)"], 10 * (1 - np.exp([-1, -4])), rtol=1e-8)
            np.testing.assert_allclose(sol.outputs["{v(in)-v(out)}"], 10 * np.exp([-1, -4]), rtol=1e-8)
            self.assertAlmostEqual(sol.measurements["t63"] / (1e-3 * math.log(2)), 1, delta=1e-8)
            self.assertIsNone(sol.measurements["never"])
            self.assertRegex(sol.summary.measurements[1].reason, "at no time")
            with self.assertRaisesRegex(dlcs.InvalidArgument, "x0: is part of the problem"):
                dlcs.solve(problem, x0=[0])
            self.addCleanup(os.chdir, os.getcwd())
            os.chdir(folder)
            self.assertEqual(dlcs.read_deck("-charger.cir", dlcs=DLCS).message, problem.message)

    def test_a_deck_with_a_fault_names_file_line_and_column(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "bad.cir"
            path.write_text("title\nR1 a 0 4k7\n.tran 1u 1m\n")
            with self.assertRaisesRegex(dlcs.InvalidArgument, 'bad.cir:2:8: .*"4k7" is not a number') as caught:
                dlcs.read_deck(path, dlcs=DLCS)
            self.assertEqual([violation.field for violation in caught.exception.violations], ["path"])
            with self.assertRaisesRegex(dlcs.InvalidArgument, "no-such-deck.cir"):
                dlcs.read_deck(f"{folder}/no-such-deck.cir", dlcs=DLCS)
        with self.assertRaisesRegex(dlcs.Unavailable, "no-such-dlcs is not a program"):
            dlcs.read_deck("a.cir", dlcs="no-such-dlcs")


class BitsTest(unittest.TestCase):
    def test_are_those_of_the_command_line(self):
        for name in ("example-4.1", "rectifier", "four-variables"):
            path = SOURCE / "deploy/examples" / f"{name}.json"
            problem = json.loads(path.read_text())
            done = subprocess.run(
                [DLCS, "solve", str(path), "--format", "json", "--quiet", "--tolerance", "1e-7"],
                capture_output=True,
                text=True,
                check=True,
            )
            there = json.loads(done.stdout)["trajectory"]
            sol = dlcs.solve(
                *(problem[key] for key in "ABNM"),
                problem.get("f"),
                problem.get("g"),
                x0=problem["x0"],
                t_span=(0, problem["T"]),
                tol=1e-7,
                breaks=problem.get("break_points", ()),
            )
            np.testing.assert_array_equal(sol.t, there["times"])
            np.testing.assert_array_equal(sol.x.T.ravel(), there["x"])
            np.testing.assert_array_equal(sol.y.T.ravel(), there["y"])
            np.testing.assert_array_equal(sol.w.T.ravel(), there["w"])


class JobsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.server = subprocess.Popen(
            [DLCSD, "--listen", "127.0.0.1:0", "--store", f"{cls.folder.name}/jobs.db"],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        cls.address = cls.server.stdout.readline().split()[-1]

    @classmethod
    def tearDownClass(cls):
        cls.server.terminate()
        assert cls.server.wait(timeout=20) == 0
        cls.server.stdout.close()
        cls.folder.cleanup()

    def test_a_job_has_the_bits_of_a_solve(self):
        problem = FOUR_ONE | {"f": ["1.2*sin(10*t)", "0"], "tol": 1e-8}
        with dlcs.Client(self.address, timeout=60) as client:
            name = client.submit(**problem, request_id="one", title="four one")
            self.assertEqual(client.submit(**problem, request_id="one", title="four one"), name)
            sol = client.result(name)
            direct = client.solve(**problem)
            np.testing.assert_array_equal(sol.x, direct.x)
            np.testing.assert_array_equal(sol.t, direct.t)
            kinds = [event.WhichOneof("kind") for event in client.watch(name)]
            self.assertIn("state", kinds)
            self.assertEqual(kinds[-1], "summary")
            self.assertIn(name, [job.name for job in client.jobs()])
            self.assertEqual(client.job(name).title, "four one")
            with self.assertRaises(dlcs.AlreadyExists):
                client.submit(**(problem | {"tol": 1e-7}), request_id="one")
            client.delete(name)
            with self.assertRaises(dlcs.NotFound):
                client.job(name)
            self.assertGreater(client.capabilities().max_states, 0)

    def test_a_job_keeps_outputs_and_measurements(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "charger.cir"
            path.write_text(DECK)
            problem = dlcs.read_deck(path, dlcs=DLCS)
        with dlcs.Client(self.address) as client:
            direct = client.solve(problem, steps=1000)
            job = client.result(client.submit(problem, steps=1000))
            self.assertEqual(list(job.outputs), ["v(out)", "{v(in)-v(out)}"])
            for name, values in direct.outputs.items():
                np.testing.assert_array_equal(job.outputs[name], values)
            self.assertEqual(job.measurements, direct.measurements)

    def test_asyncio_has_the_same_calls(self):
        problem = FOUR_ONE | {"f": ["1.2*sin(10*t)", "0"], "tol": 1e-8}

        async def run():
            async with dlcs.aio.Client(self.address, timeout=60) as client:
                name = await client.submit(**problem)
                one, two = await asyncio.gather(client.result(name), client.solve(**problem))
                np.testing.assert_array_equal(one.x, two.x)
                self.assertEqual((await client.job(name)).name, name)
                times = np.array([0.123, 0.4567])
                size = np.abs(two.x).max(axis=1)
                self.assertLessEqual((np.abs(await two(times) - exact(times)).max(axis=1) / size).max(), 1e-8)
                np.testing.assert_array_equal(await two(two.t[3]), two.x[:, 3])
                with self.assertRaisesRegex(dlcs.InvalidArgument, "t: .* must lie in"):
                    await two(7)
                steps = client.iterate(**FOUR_ONE, steps=100, method="laplace-iteration")
                with self.assertRaises(dlcs.FailedPrecondition):
                    steps.solution
                self.assertTrue([i async for i in steps])
                self.assertTrue(steps.solution.success)
                with self.assertRaises(dlcs.NotFound):
                    await client.job("jobs/" + 26 * "a")
                with self.assertRaises(dlcs.InvalidArgument):
                    await client.solve(**FOUR_ONE, theta=3, steps=3, method="time-stepping")

        asyncio.run(run())

    def test_waits_for_a_busy_server_within_the_timeout(self):
        server = subprocess.Popen(
            [DLCSD, "--listen", "127.0.0.1:0", "--max-concurrent-solves", "1"], stdout=subprocess.PIPE, text=True
        )
        self.addCleanup(server.stdout.close)
        self.addCleanup(server.wait)
        self.addCleanup(server.kill)
        address = server.stdout.readline().split()[-1]

        async def together():
            async with dlcs.aio.Client(address, timeout=60) as client:
                return await asyncio.gather(*(client.solve(**FOUR_ONE) for _ in range(4)))

        one, *others = asyncio.run(together())
        self.assertTrue(one.success)
        for other in others:
            np.testing.assert_array_equal(other.x, one.x)

        with dlcs.Client(address) as client, dlcs.Client(address, timeout=0.5) as hasty:
            iterates = iter(client.iterate(**FOUR_ONE, steps=1_000_000, t_eval=[1], method="laplace-iteration"))
            next(iterates)
            begin = time.monotonic()
            with self.assertRaises(dlcs.ResourceExhausted) as refused:
                hasty.solve(**FOUR_ONE)
            self.assertLess(time.monotonic() - begin, 0.5)
            self.assertGreater(refused.exception.retry_after, 0.5)
            for _ in iterates:
                pass
            self.assertTrue(client.solve(**FOUR_ONE).success)

    def test_a_server_that_is_not_there_is_unavailable(self):
        with dlcs.Client("127.0.0.1:1", timeout=20) as client:
            with self.assertRaises(dlcs.Unavailable):
                client.capabilities()

    def test_reads_wait_for_a_server_that_is_started_again(self):
        with tempfile.TemporaryDirectory() as folder, create_server(("127.0.0.1", 0)) as held:
            address = f"127.0.0.1:{held.getsockname()[1]}"
            held.close()

            def start():
                server = subprocess.Popen(
                    [DLCSD, "--listen", address, "--store", f"{folder}/jobs.db"],
                    stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL,
                    text=True,
                )
                self.addCleanup(server.stdout.close)
                self.addCleanup(server.wait)
                self.addCleanup(server.kill)
                return server

            server = start()
            server.stdout.readline()
            with dlcs.Client(address, timeout=60) as client:
                name = client.submit(**FOUR_ONE, f=["1.2*sin(10*t)", "0"], tol=1e-8)
                expected = client.result(name).x

                async def read_again():
                    async with dlcs.aio.Client(address, timeout=60) as other:
                        return (await other.job(name)).name

                reads = (
                    lambda: [job.name for job in client.jobs()][0],
                    lambda: name if np.array_equal(client.result(name).x, expected) else None,  # a watch at first
                    lambda: asyncio.run(read_again()),
                )
                for read in reads:
                    server.kill()
                    server.wait()
                    later = threading.Timer(0.3, lambda: servers.append(start()))
                    servers = []
                    later.start()
                    self.assertEqual(read(), name)
                    later.join()
                    server = servers[0]
                # Whether a call that writes has happened is not known: it is the caller's to repeat.
                server.kill()
                server.wait()
                with self.assertRaises(dlcs.Unavailable):
                    client.delete(name)

    def test_a_token_is_not_sent_without_encryption(self):
        with self.assertRaisesRegex(dlcs.InvalidArgument, "without encryption"):
            dlcs.Client("solver.example.com:50051", token="secret")


class PrivateServerTest(unittest.TestCase):
    PROGRAM = (
        "import sys, time; sys.path.insert(0, sys.argv[1]); import dlcs;"
        "from dlcs.private_server import private_server;"
        "dlcs.solve([[-1]], [[0]], [[0]], [[1]], x0=[1], t_span=(0, 1));"
        "print(private_server(), flush=True); time.sleep(float(sys.argv[2]))"
    )

    def start(self, seconds):
        process = subprocess.Popen(
            [sys.executable, "-c", self.PROGRAM, str(SOURCE / "client/python/src"), str(seconds)],
            stdout=subprocess.PIPE,
            text=True,
        )
        socket = pathlib.Path(process.stdout.readline().strip().removeprefix("unix:"))
        process.stdout.close()
        return process, socket

    def servers_of(self, socket):
        listing = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=True).stdout
        return [line for line in listing.splitlines() if f"--listen unix:{socket}" in line]

    def test_admits_this_user_alone_and_ends_with_the_process(self):
        process, socket = self.start(1)
        self.assertEqual(stat.S_IMODE(socket.parent.stat().st_mode), 0o700)
        self.assertEqual(stat.S_IMODE(socket.stat().st_mode), 0o600)
        self.assertEqual(len(self.servers_of(socket)), 1)
        self.assertEqual(process.wait(timeout=30), 0)
        self.assertEqual(self.servers_of(socket), [])
        self.assertFalse(socket.parent.exists())

    def test_the_command_line_reaches_a_unix_socket(self):
        process, socket = self.start(600)
        example = SOURCE / "deploy/examples/rectifier.json"
        done = subprocess.run(
            [DLCS, "solve", str(example), "--server", f"unix:{socket}"], capture_output=True, text=True
        )
        process.kill()
        process.wait(timeout=30)
        self.assertIn("SOLVED", done.stdout, done.stderr)

    def test_ends_with_a_process_that_is_killed(self):
        process, socket = self.start(600)
        self.assertEqual(len(self.servers_of(socket)), 1)
        process.send_signal(signal.SIGKILL)
        process.wait(timeout=30)
        deadline = time.monotonic() + 20
        while self.servers_of(socket) and time.monotonic() < deadline:
            time.sleep(0.05)
        self.assertEqual(self.servers_of(socket), [])

    def test_a_program_that_is_missing_or_fails_is_named(self):
        with self.assertRaisesRegex(dlcs.Unavailable, "no-such-dlcsd"):
            dlcs.Client(dlcsd="no-such-dlcsd")
        with self.assertRaisesRegex(dlcs.Unavailable, "did not start"):
            dlcs.Client(dlcsd="/bin/false")


class PackageTest(unittest.TestCase):
    def test_the_contract_is_that_of_the_tree(self):
        for name in ("SolveEvent", "SolveOptions", "SolveJob"):
            fields = {field.name for field in messages.message(f"dlcs.v1.{name}").DESCRIPTOR.fields}
            text = "".join(path.read_text() for path in (SOURCE / "proto/dlcs/v1").glob("*.proto"))
            for field in fields:
                self.assertIn(f" {field} = ", text)

    def test_the_notebook_runs(self):
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(
                [sys.executable, str(SOURCE / "deploy/examples/notebook.py")],
                capture_output=True,
                text=True,
                cwd=folder,
                env=os.environ | {"PYTHONPATH": str(SOURCE / "client/python/src")},
            )
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(done.stdout.count("SOLVED"), 2, done.stdout)

    def test_the_wheel_has_the_contract_and_solves(self):
        with tempfile.TemporaryDirectory() as folder:
            built = subprocess.run(
                [sys.executable, "-m", "pip", "wheel", "--no-build-isolation", "--no-deps", "--quiet"]
                + ["--wheel-dir", folder, str(SOURCE / "client/python")],
                capture_output=True,
                text=True,
            )
            self.assertEqual(built.returncode, 0, built.stderr)
            wheel = next(pathlib.Path(folder).glob("dlcs_client-*.whl"))
            subprocess.run([sys.executable, "-m", "zipfile", "-e", str(wheel), f"{folder}/site"], check=True)
            self.assertTrue((pathlib.Path(folder) / "site/dlcs/contract.binpb").exists())
            self.assertTrue((pathlib.Path(folder) / "site/dlcs/py.typed").exists())
            program = (
                "import sys; sys.path.insert(0, sys.argv[1]); import dlcs; assert sys.argv[1] in dlcs.__file__;"
                "print(dlcs.solve([[-1]], [[0]], [[0]], [[1]], x0=[1], t_span=(0, 1)).message)"
            )
            done = subprocess.run(
                [sys.executable, "-c", program, f"{folder}/site"], capture_output=True, text=True, cwd=folder
            )
            self.assertRegex(done.stdout, "^SOLVED", done.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
