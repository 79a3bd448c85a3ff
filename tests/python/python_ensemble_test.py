#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Ensembles that are jobs, by the Python package on a real dlcsd.

Usage: python_ensemble_test.py DLCSD DLCS SOURCE_FOLDER
"""

import asyncio
import csv
import io
import math
import os
import pathlib
import pickle
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy as np

DLCSD, DLCS, SOURCE = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
os.environ.pop("DLCS_SERVER", None)
sys.path.insert(0, str(SOURCE / "client/python/src"))

import dlcs  # noqa: E402
from dlcs import ensemble  # noqa: E402

# x' = -x + f, and a pair that does nothing: y = 0, w = 1.
DECAY = {"A": [[-1]], "B": [[0]], "N": [[0]], "M": [[1]], "g": [1], "t_span": (0, 1)}
# A capacitor charged through a diode.
RECTIFIER = {"A": [[-1]], "B": [[10]], "N": [[1]], "M": [[0.1]], "g": ["-10*sin(2*pi*t)"], "t_span": (0, 2)}
SLOW = {"steps": 10_000, "method": "time-stepping"}


class Server:
    """A dlcsd with a store, which can be killed and started again at the same address."""

    def __init__(self):
        self.folder = tempfile.TemporaryDirectory()
        self.address = "127.0.0.1:0"
        self.start()

    def start(self):
        self.process = subprocess.Popen(
            [DLCSD, "--listen", self.address, "--store", f"{self.folder.name}/jobs.db", "--threads", "2"],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self.address = self.process.stdout.readline().split()[-1]

    def kill(self):
        self.process.kill()
        self.process.wait(timeout=20)
        self.process.stdout.close()

    def close(self):
        self.process.terminate()
        assert self.process.wait(timeout=20) == 0
        self.process.stdout.close()
        self.folder.cleanup()


class EnsembleTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Server()
        cls.client = dlcs.Client(cls.server.address, timeout=120)

    @classmethod
    def tearDownClass(cls):
        cls.client.close()
        cls.server.close()

    def solved(self, *args, **kwargs):
        return self.client.ensemble(self.client.submit_ensemble(*args, **kwargs))

    def test_initial_states_are_an_array(self):
        x0 = np.linspace(-3, 5, 50)[:, None]
        result = self.solved(x0, **DECAY, tol=1e-9, shard_members=7, title="fifty")
        self.assertTrue(result.success, result.message)
        self.assertEqual(result.state, "SUCCEEDED")
        self.assertEqual(result.message, "50 solved")
        self.assertEqual(result.columns, ["t", "error", "x1", "y1", "w1"])
        self.assertEqual(len(result), 50)
        self.assertEqual(result.x.shape, (50, 1))
        np.testing.assert_allclose(result.x, x0 / math.e, rtol=0, atol=1e-8)
        np.testing.assert_array_equal(result["x1"], result.x[:, 0])
        np.testing.assert_array_equal(result.t, np.ones(50))
        np.testing.assert_array_equal(result.y, np.zeros((50, 1)))
        np.testing.assert_array_equal(result.w, np.ones((50, 1)))
        self.assertTrue(np.all(result.error <= 1e-9))
        self.assertTrue(np.all(result.outcomes == ensemble.SOLVED))
        self.assertEqual(self.client.job(result.job).title, "fifty")
        self.assertEqual(self.client.job(result.job).ensemble.shards, 8)
        again = pickle.loads(pickle.dumps(result))
        np.testing.assert_array_equal(again.values, result.values)

    def test_members_have_the_bits_of_their_solves(self):
        x0 = np.array([[0.0], [2.5], [-1.0]])
        result = self.solved(x0, **RECTIFIER, tol=1e-8)
        for k in range(3):
            sol = self.client.solve(**RECTIFIER, x0=x0[k], tol=1e-8, t_eval=[2])
            np.testing.assert_array_equal(result.x[k], sol.x[:, 0])
            np.testing.assert_array_equal(result.y[k], sol.y[:, 0])

    def test_parameters_are_columns(self):
        # x' = -x + a, x(0) = b: x(1) = a + (b - a)/e.
        a, b = np.array([1.0, 2.0, 3.0, -4.0]), np.array([0.5, 0.0, 7.0, 1.0])
        system = DECAY | {"f": ["a"], "parameters": {"a": 9}, "tol": 1e-10}
        result = self.solved({"a": a, "x0": b[:, None]}, **system, outputs={"twice": ([2], None, "a")})
        np.testing.assert_allclose(result.x[:, 0], a + (b - a) / math.e, atol=1e-8)
        np.testing.assert_allclose(result.outputs["twice"], 2 * result.x[:, 0] + a, atol=1e-12)
        only = self.solved({"a": a}, **system, x0=[1])
        np.testing.assert_allclose(only.x[:, 0], a + (1 - a) / math.e, atol=1e-8)
        default = self.solved([[1]], **system)
        np.testing.assert_allclose(default.x[0, 0], 9 - 8 / math.e, atol=1e-8)

    def test_members_may_differ_in_anything_but_matrices(self):
        members = [
            {"x0": [1]},
            {"f": ["2"], "t_end": 3},
            {"f": lambda t: [float(t >= 0.25)], "breaks": [0.25]},
            {"g": [5], "x0": [2]},
        ]
        result = self.solved(members, **DECAY, x0=[0], tol=1e-9)
        exact = [1 / math.e, 2 * (1 - math.exp(-3)), 1 - math.exp(-0.75), 2 / math.e]
        np.testing.assert_allclose(result.x[:, 0], exact, atol=1e-8)
        np.testing.assert_array_equal(result.t, [1, 3, 1, 1])
        np.testing.assert_array_equal(result.w[:, 0], [1, 1, 1, 5])

    def test_a_span_may_begin_anywhere(self):
        members = [{"f": lambda t: [float(t >= 5.5)], "breaks": [5.5]}, {"t_end": 7}]
        result = self.solved(members, **(DECAY | {"t_span": (5, 6)}), x0=[1], tol=1e-9)
        exact = [1 / math.e + 1 - math.exp(-0.5), math.exp(-2)]
        np.testing.assert_allclose(result.x[:, 0], exact, atol=1e-8)

    def test_chosen_values_and_extrema_are_kept(self):
        # x1' = x2, x2' = -x1: (sin t, cos t) times the first value.
        swing = {"A": [[0, 1], [-1, 0]], "B": [[0], [0]], "N": [[0, 0]], "M": [[1]], "g": [1], "t_span": (0, 7)}
        size = np.array([1.0, 2.0, 3.0])
        x0 = np.outer(size, [0, 1])
        keep = {"extrema": True, "x_components": [0], "omit_y": True, "omit_w": True}
        result = self.solved(x0, **swing, tol=1e-9, keep=keep, t_eval=[math.pi / 2, 3 * math.pi / 2])
        self.assertEqual(result.columns, ["t", "error", "x1", "min(x1)", "max(x1)"])
        np.testing.assert_allclose(result.x[:, 0], size * math.sin(7), atol=1e-8)
        np.testing.assert_allclose(result["max(x1)"], size, atol=1e-8)
        np.testing.assert_allclose(result["min(x1)"], -size, atol=1e-8)
        self.assertEqual(result.y.shape, (3, 0))

    def test_quantiles_are_those_of_numpy(self):
        x0 = np.random.default_rng(1).normal(size=(101, 1))
        result = self.solved(x0, **DECAY, tol=1e-10)
        shares = [0, 0.05, 0.5, 1]
        at = result.columns.index("x1")
        np.testing.assert_allclose(result.quantiles(shares)[:, at], np.quantile(x0 / math.e, shares), atol=1e-8)
        for wrong in ([-0.1], [1.1], "half", [math.nan]):
            with self.assertRaises(dlcs.InvalidArgument):
                result.quantiles(wrong)

    def test_a_member_without_a_solution_is_a_result_with_a_reason(self):
        # x' = x is beyond all numbers at t = 1000, where one member ends.
        system = DECAY | {"A": [[1]]}
        result = self.solved([{}, {"t_end": 1000}, {}], **system, x0=[1], tol=1e-6)
        self.assertFalse(result.success)
        self.assertEqual(result.state, "SUCCEEDED")
        self.assertEqual(list(result.failures), [1])
        self.assertTrue(result.failures[1])
        self.assertEqual(result.outcomes[1], ensemble.FAILED)
        self.assertEqual((result.outcomes == ensemble.FAILED).sum(), 1)
        self.assertIn("1 failed", result.message)

    def test_columns_are_named_as_by_the_command_line(self):
        outputs = {"t": ([1],), "x1": ([2],), "min(x1)": ([3],)}
        name = self.client.submit_ensemble([[1], [2]], **DECAY, outputs=outputs, keep={"extrema": True})
        result = self.client.ensemble(name)
        done = subprocess.run(
            [DLCS, "result", name, "--server", self.server.address, "--format", "csv"],
            capture_output=True,
            text=True,
            check=True,
        )
        lines = list(csv.reader(io.StringIO(done.stdout)))
        self.assertEqual(lines[0][2:], result.columns)
        np.testing.assert_array_equal(np.array([line[2:] for line in lines[1:]], dtype=float), result.values)

    def test_progress_can_be_watched(self):
        name = self.client.submit_ensemble(np.ones((10, 1)), **DECAY, shard_members=3)
        counts = [e.checkpointed.times for e in self.client.watch(name) if e.WhichOneof("kind") == "checkpointed"]
        self.assertEqual(len(counts), 4)
        self.assertEqual(counts[-1], 10)
        self.assertEqual(self.client.job(name).ensemble.counts.solved, 10)
        self.assertEqual(sorted(shard.first_member for shard in self.client.shards(name)), [0, 3, 6, 9])

    def test_what_is_stored_of_a_stopped_ensemble_can_be_read(self):
        name = self.client.submit_ensemble(np.ones((5000, 1)), **RECTIFIER, **SLOW, shard_members=10)
        for _ in self.client.shards(name):
            break
        self.client.cancel(name)
        result = self.client.ensemble(name)
        self.assertEqual(result.state, "CANCELLED")
        self.assertFalse(result.success)
        self.assertIn("missing; CANCELLED", result.message)
        here = result.outcomes != ensemble.MISSING
        self.assertTrue(0 < here.sum() < 5000)
        self.assertTrue(np.all(np.isfinite(result.x[here])))
        self.assertTrue(np.all(np.isnan(result.x[~here])))

    def test_a_deadline_ends_it_with_what_is_stored(self):
        begin = time.monotonic()
        name = self.client.submit_ensemble(np.ones((5000, 1)), **RECTIFIER, **SLOW, shard_members=10, deadline=1.5)
        result = self.client.ensemble(name)
        self.assertGreater(time.monotonic() - begin, 1.4)
        self.assertLess(time.monotonic() - begin, 10)
        self.assertEqual(result.state, "FAILED")
        self.assertRegex(result.message, "missing; FAILED: The deadline passed")
        self.assertTrue(0 < (result.outcomes != ensemble.MISSING).sum() < 5000)

    def test_the_same_request_is_one_job(self):
        names = {self.client.submit_ensemble([[1], [2]], **DECAY, request_id="one") for _ in range(2)}
        self.assertEqual(len(names), 1)
        with self.assertRaises(dlcs.AlreadyExists):
            self.client.submit_ensemble([[1], [3]], **DECAY, request_id="one")

    def test_each_call_says_what_reads_the_job(self):
        solve = self.client.submit(**DECAY, x0=[1])
        with self.assertRaisesRegex(dlcs.FailedPrecondition, "is not an ensemble"):
            self.client.ensemble(solve)
        name = self.client.submit_ensemble([[1]], **DECAY)
        with self.assertRaisesRegex(dlcs.FailedPrecondition, r"read it with ensemble\(\)"):
            self.client.result(name)

    def test_what_is_wrong_is_named(self):
        good = {"members": [[1], [2]]}
        for change, field in (
            ({"members": []}, "members"),
            ({"members": None}, "members"),
            ({"members": "abc"}, "members"),
            ({"members": [1, 2]}, "members"),
            ({"members": {}}, "members"),
            ({"members": {"x0": [[1], [2]], "a": [1]}}, "members"),
            ({"members": {"x0": [1]}}, "members['x0']"),
            ({"members": {5: [1]}}, "members"),
            ({"members": [[1, 2]]}, "A"),
            ({"members": [[1, 2]], "x0": [1]}, "members"),
            ({"members": [{"x0": [1]}, [2]]}, "members[1]"),
            ({"members": [{"x0": [1]}, {"x0": [1, 2]}]}, "members[1].x0"),
            ({"members": [{"x0": [1]}, {"f": [1, 2]}]}, "members[1].f"),
            ({"members": [{"x0": [1]}, {"t_end": -1}]}, "members[1].t_end"),
            ({"members": [{"x0": [1]}, {"breaks": "a"}]}, "members[1].breaks"),
            ({"members": [{"x0": [1], "A": [[1]]}]}, "members[0]"),
            ({"members": [{"x0": [1], "parameters": [1]}]}, "members[0].parameters"),
            ({"members": [{"x0": [1], "parameters": {"a": "b"}}]}, "members[0].parameters['a']"),
            ({"parameters": [1]}, "parameters"),
            ({"keep": {"nothing": True}}, "keep"),
            ({"keep": 5}, "keep"),
            ({"shard_members": 1.5}, "shard_members"),
            ({"shard_members": -1}, "shard_members"),
            ({"t_eval": [0.5]}, "t_eval"),
            ({"deadline": -1}, "deadline"),
            ({"deadline": "soon"}, "deadline"),
            ({"priority": "high"}, "priority"),
            ({"members": [[1], [math.nan]]}, "ensemble.members[1].x0[0]"),
            ({"keep": {"x_components": [3]}}, "results.x_components[0]"),
        ):
            with self.subTest(str(change)):
                with self.assertRaises(dlcs.InvalidArgument) as raised:
                    self.client.submit_ensemble(**(good | DECAY | change))
                self.assertEqual([v.field for v in raised.exception.violations], [field], raised.exception)

    def test_asyncio_has_the_same_calls(self):
        async def run():
            async with dlcs.aio.Client(self.server.address, timeout=60) as client:
                name = await client.submit_ensemble(np.ones((9, 1)), **DECAY, shard_members=4, tol=1e-9)
                result = await client.ensemble(name)
                np.testing.assert_allclose(result.x, np.full((9, 1), 1 / math.e), atol=1e-8)
                self.assertEqual(len([shard async for shard in client.shards(name)]), 3)
                with self.assertRaises(dlcs.FailedPrecondition):
                    await client.result(name)
                with self.assertRaises(dlcs.NotFound):
                    await client.ensemble("jobs/" + 26 * "a")

        asyncio.run(run())


class BrokenConnectionTest(unittest.TestCase):
    """The server is killed while its results are followed, and started again."""

    def setUp(self):
        self.server = Server()
        self.addCleanup(lambda: self.server.close())

    def kill_and_start(self):
        self.server.kill()
        time.sleep(0.5)
        self.server.start()

    def check(self, name, firsts):
        self.assertEqual(sorted(firsts), list(range(0, 600, 10)))
        self.assertEqual(self.job_of_now(name).ensemble.shards_done, 60)

    def job_of_now(self, name):
        """Channels of one process share connections: a new client may get the one that has just been broken."""
        client = self.client_of_now()
        for _ in range(50):
            try:
                return client.job(name)
            except dlcs.Unavailable:
                time.sleep(0.1)
        return client.job(name)

    def client_of_now(self):
        client = dlcs.Client(self.server.address, timeout=60)
        self.addCleanup(client.close)
        return client

    def test_each_shard_comes_once(self):
        client = self.client_of_now()
        name = client.submit_ensemble(np.ones((600, 1)), **RECTIFIER, **SLOW, shard_members=10)
        firsts, killing = [], []
        for shard in client.shards(name):
            firsts.append(shard.first_member)
            if len(firsts) in (3, 20):
                killing.append(threading.Thread(target=self.kill_and_start))
                killing[-1].start()
        for thread in killing:
            thread.join()
        self.assertEqual(len(killing), 2)
        self.check(name, firsts)

    def test_each_shard_comes_once_in_asyncio(self):
        name = self.client_of_now().submit_ensemble(np.ones((600, 1)), **RECTIFIER, **SLOW, shard_members=10)

        async def run():
            firsts = []
            async with dlcs.aio.Client(self.server.address, timeout=60) as client:
                async for shard in client.shards(name):
                    firsts.append(shard.first_member)
                    if len(firsts) == 5:
                        await asyncio.get_running_loop().run_in_executor(None, self.kill_and_start)
            return firsts

        self.check(name, asyncio.run(run()))

    def test_patience_ends(self):
        client = self.client_of_now()
        name = client.submit_ensemble(np.ones((600, 1)), **RECTIFIER, **SLOW, shard_members=10)
        shards = client.shards(name, patience=1)
        next(shards)
        self.server.kill()
        begin = time.monotonic()
        with self.assertRaises(dlcs.Unavailable):
            list(shards)
        self.assertTrue(0.9 < time.monotonic() - begin < 10)
        self.server.start()
        for wrong in (-1, "long", None):
            with self.assertRaises(dlcs.InvalidArgument):
                next(client.shards(name, patience=wrong))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
