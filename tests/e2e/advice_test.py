#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a verdict that missed advises is typed, and solves the problem.

    advice_test.py DLCS
"""

import json
import re
import shlex
import subprocess
import sys
import unittest

DLCS = sys.argv[1]


def run(problem, options):
    return subprocess.run([DLCS, "solve", "-", "--format", "json", *options], input=json.dumps(problem),
                          capture_output=True, text=True, check=False)  # fmt: skip


def spring(horizon, stop, rate=1.0, damping=0.0):
    """A spring that swings against an elastic stop: rounding grows over the impacts."""
    return {"states": ["position", "speed"], "pairs": ["stop"], "A": [[0, 1], [-rate * rate, -damping]],
            "B": [[0], [1]], "N": [[1, 0]], "M": [[stop]], "g": ["0.5"], "x0": [1, 0], "T": horizon}  # fmt: skip


def closed_switches(a):
    """Two closed switches with modelled limits of a times their resistances: x' is a difference of large numbers."""
    return {"A": [[-1]], "B": [[-a, a]], "N": [[0], [0]], "M": [[a + 0.1, -a], [-a, a + 0.02]],
            "f": [str(-200 * a)], "g": [str(200 * a - 20), str(-200 * a - 25)], "x0": [0], "T": 5}  # fmt: skip


def follower(gain):
    """What follows the difference of two oscillators that are equal but for 1e-9."""
    return {"states": ["a", "va", "b", "vb", "z"],
            "A": [[0, 1, 0, 0, 0], [-1, 0, 0, 0, 0], [0, 0, 0, 1, 0], [0, 0, -1, 0, 0], [gain, 0, -gain, 0, -1]],
            "B": [[0], [0], [0], [0], [0]], "N": [[0, 0, 0, 0, 0]], "M": [[1]], "g": ["1"],
            "x0": [1, 0, 1 + 1e-9, 0, 0], "T": 60,
            "outputs": {"names": ["v(a,b)", "i(it's)"], "C": [[1, 0, -1, 0, 0], [0, 0, 0, 0, 1e-3]],
                        "D": [[0], [0]], "h": [0, 0]}}  # fmt: skip


def growth(rate):
    """A difference of two states that are equal grows by e^36: nothing of it is known."""
    return {"A": [[rate, 1, -1], [0, -1, 0], [0, 0, -1]], "B": [[0], [0], [0]], "N": [[0, 0, 0]], "M": [[1]],
            "f": ["0", "sin(t)", "sin(t)"], "g": ["1"], "x0": [0, 0.3, 0.3], "T": 36 / rate}  # fmt: skip


def stiff(rate):
    """A slow oscillator with a stop, beside states that follow it within 1/rate."""
    return {"A": [[0, 1, 0, 0], [-4, 0, 0, 0], [rate, 0, -rate, 0], [0, 0, rate * rate, -rate * rate]],
            "B": [[0], [1], [0], [0]], "N": [[1, 0, 0, 0]], "M": [[0.001]], "g": ["0.5"],
            "x0": [1, 0, 1, 1], "T": 500}  # fmt: skip


FOUR_ONE = {"A": [[-4, 0], [0, -2]], "B": [[1, 0], [0, 1]], "N": [[1, 0], [-1, 0]], "M": [[2, 0], [0, 3]],
            "f": ["1.2*sin(10*t)", "0"], "x0": [0, 1], "T": 1}  # fmt: skip
NONLINEAR = {"kind": "nonlinear", "f": ["-x1 + y1", "sin(5*t) - x2"], "g": ["x1 + y1 + y1^3 + cos(3*t)"],
             "x0": [1, 0], "T": 3}  # fmt: skip


class AdviceTest(unittest.TestCase):
    # Problems with the options that they miss with, and whether it is by steps.
    BY_ROUNDING = {
        "spring against a stop": (spring(3000, 0.001), "--tolerance 1e-10"),
        "spring against a softer stop": (spring(3000, 0.01), "--tolerance 1e-10"),
        "the same to the last digits": (spring(3000, 0.001), "--tolerance 1e-13"),
        "fast spring": (spring(300, 0.0002, 11), "--tolerance 1e-12"),
        "stiff": (stiff(1e4), "--tolerance 1e-12"),
        "closed switches": (closed_switches(1e6), "--tolerance 1e-11"),
        "difference": (follower(1e3), "--tolerance 1e-9"),
        "growth": (growth(6), "--tolerance 1e-9"),
    }
    BY_STEPS = {
        "default work": (FOUR_ONE, "--method time-stepping"),
        "default work of an oscillator": (spring(5, 0.1), "--method time-stepping"),
        "Laplace": (spring(20, 0.01), "--method laplace-iteration"),
        "exponential integrator": (spring(100, 0.01), "--method exponential-integrator --tolerance 1e-12"),
        "nonlinear": (NONLINEAR, "--tolerance 1e-12"),
        "too few steps": (spring(20, 0.01), "--steps 12"),
        "too few steps by another method": (spring(20, 0.01, 3), "--steps 20 --method time-stepping"),
    }

    def alternatives(self, problem, options):
        """The options that the verdict of a solve that misses advises, each as typed words."""
        done = run(problem, options)
        self.assertEqual(done.returncode, 1, done.stderr)
        verdict = json.loads(done.stdout)["summary"]["verdict"]
        lines = [line.removeprefix("dlcs: ") for line in done.stderr.splitlines() if " accepts " in line]
        self.assertEqual(lines, verdict["concerns"][-1:], done.stderr)
        advice = re.sub(r" accepts (it|all of them)\.( A smaller tolerance makes the steps shorter\.)?$", "", lines[0])
        return [shlex.split(alternative) for alternative in advice.split(" or ")]

    def outcome(self, problem, options, advice):
        """Whether `advice`, in place of a tolerance among the options, solves the problem; and the verdict."""
        if advice[0] in options:
            at = options.index(advice[0])
            options = options[:at] + options[at + 2 :]
        done = run(problem, [*options, *advice])
        self.assertTrue(done.stdout, done.stderr)
        verdict = json.loads(done.stdout)["summary"]["verdict"]
        are_steps_given = "--steps" in options and advice[0] != "--tolerance"
        expected = "reached T, estimated error" if are_steps_given else "SOLVED within an error of"
        return done.returncode == 0 and verdict["text"].startswith(expected), verdict["text"]

    def check(self, cases):
        for name, (problem, options) in cases.items():
            for advice in self.alternatives(problem, options.split()):
                with self.subTest(name, advice=advice):
                    good, text = self.outcome(problem, options.split(), advice)
                    self.assertTrue(good, text)

    def test_holds_where_rounding_decides(self):
        self.check(self.BY_ROUNDING)

    def test_holds_where_steps_decide(self):
        self.check(self.BY_STEPS)

    def test_is_one_list_for_all_components_as_a_shell_reads_it(self):
        problem, options = self.BY_ROUNDING["difference"]
        words = dict(self.alternatives(problem, options.split()))
        self.assertRegex(words["--absolute-tolerance"], r"^z=[^,]+,i\(it's\)=[^,]+$")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
