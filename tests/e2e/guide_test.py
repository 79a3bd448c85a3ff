#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The five problems of client/guide compared with solutions that do not come from dlcs: closed forms, SciPy, a binomial
tree, published values.

    guide_test.py PROJECT_FOLDER DLCS
"""

import json
import pathlib
import subprocess
import sys
import unittest

import numpy as np
import scipy.sparse as sparse
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

PROJECT, DLCS = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2]
EXAMPLES = PROJECT / "deploy/examples"


class Result:
    """What `dlcs solve` prints as JSON, with x, y and w as arrays of rows: x["voltage"], w["f1"]."""

    def __init__(self, text):
        root = json.loads(text)
        self.t = np.array(root["trajectory"]["times"])
        self.switches = np.array([switch["time"] for switch in root["summary"]["switching_times"]])
        self.success = root["summary"]["verdict"]["success"]

        def by_name(kind, names):
            values = np.array(root["trajectory"][kind]).reshape(self.t.size, -1).T
            return dict(zip(names or [f"{kind}{k + 1}" for k in range(len(values))], values))

        analysis = root["analysis"]
        self.x = by_name("x", analysis.get("state_names"))
        self.y = by_name("y", analysis.get("pair_names"))
        self.w = by_name("w", analysis.get("pair_names"))


def run(*arguments, text=None):
    return subprocess.run([DLCS, *arguments], input=text, capture_output=True, text=True, check=True).stdout


def solve(problem, *options):
    """`problem` is a file, or the text of one."""
    is_file = isinstance(problem, pathlib.Path)
    text = run("solve", str(problem) if is_file else "-", "--format", "json", "--quiet", *options,
               text=None if is_file else problem)
    result = Result(text)
    assert result.success
    return result


def example(name, **changes):
    """The text of an example with some keys or parameters replaced."""
    root = json.loads((EXAMPLES / name).read_text())
    root.pop("$schema", None)
    for key, value in changes.items():
        target = root if key in root else root["parameters"]
        target[key] = value
    return json.dumps(root)


def times(*numbers):
    return ",".join(f"{number:.17g}" for number in np.ravel(numbers))


class DiodeBridgeTest(unittest.TestCase):
    """C v' = max(0, |e| - v)/R - v/load in closed form, phase after phase."""

    R, C, LOAD, PEAK, OMEGA, T = 1, 0.002, 25, 10, 100 * np.pi, 0.045

    def phases(self):
        """(begin, end, whether a pair of diodes conducts, v as a function of time)."""
        begin, v, conducts = 0.0, 0.0, True
        while begin < self.T:
            rate = 1 / (self.LOAD * self.C) + (1 / (self.R * self.C) if conducts else 0)
            # The particular solution for e = PEAK sin(OMEGA t), with the sign of e in this half wave.
            sign = 1 if int(begin * self.OMEGA / np.pi + 1e-9) % 2 == 0 else -1
            drive = sign * self.PEAK / (self.R * self.C) if conducts else 0
            norm = rate**2 + self.OMEGA**2

            def particular(t, drive=drive, rate=rate, norm=norm):
                return drive * (rate * np.sin(self.OMEGA * t) - self.OMEGA * np.cos(self.OMEGA * t)) / norm

            def value(t, begin=begin, v=v, rate=rate, particular=particular):
                return (v - particular(begin)) * np.exp(-rate * (t - begin)) + particular(t)

            def gap(t, value=value):
                return abs(self.PEAK * np.sin(self.OMEGA * t)) - value(t)

            # Conduction ends before the half wave does, and begins again before the next maximum.
            half = np.pi / self.OMEGA
            number = int(begin / half + 1e-9)
            zero = (number + 1) * half
            low, high = (begin + 1e-5, zero) if conducts else (zero, zero + half / 2)
            end = brentq(gap, low, high, xtol=1e-16)
            yield begin, min(end, self.T), conducts, value
            begin, v, conducts = end, value(end), not conducts

    def test_is_one_diode_that_is_fed_by_the_absolute_value(self):
        at = np.linspace(0.0005, self.T, 90)
        result = solve(EXAMPLES / "diode-bridge.json", "--at", times(at))
        phases = list(self.phases())
        np.testing.assert_equal(len(phases), 9)
        for begin, end, conducts, value in phases:
            here = (at >= begin) & (at <= end)
            np.testing.assert_allclose(result.x["voltage"][here], value(at[here]), rtol=0, atol=1e-8)
            source = self.PEAK * np.sin(self.OMEGA * at[here])
            current = (np.abs(source) - value(at[here])) / self.R if conducts else 0 * source
            forward = np.where(source > 0, current, 0)
            np.testing.assert_allclose(result.y["f1"][here], forward, rtol=0, atol=1e-8)
            np.testing.assert_allclose(result.y["r2"][here], forward, rtol=0, atol=1e-8)
            np.testing.assert_allclose(result.w["f2"][here], current - forward, rtol=0, atol=1e-8)
            np.testing.assert_allclose(result.w["r1"][here], current - forward, rtol=0, atol=1e-8)
            if end < self.T:
                self.assertLess(np.abs(result.switches - end).min(), 1e-10)

    def test_currents_and_ripple_are_those_of_the_guide(self):
        result = solve(EXAMPLES / "diode-bridge.json", "--at", "0:0.00001:0.045")
        self.assertAlmostEqual(result.y["f1"].max(), 4.0, delta=0.05)
        late = result.t > 0.0245
        self.assertAlmostEqual(result.w["f2"][late].max(), 1.5, delta=0.1)
        self.assertAlmostEqual(np.mean(result.x["voltage"][late]) / self.LOAD, 0.35, delta=0.02)
        self.assertAlmostEqual(np.ptp(result.x["voltage"][late]), 1.1, delta=0.06)


class MembraneTest(unittest.TestCase):
    def model(self, cells, horizon):
        return run("model", "signorini", "--cells", str(cells), "--coefficient", "0.2", "--horizon", str(horizon))

    def test_three_methods_agree(self):
        problem, at = self.model(16, 1), ("--tolerance", "1e-6", "--at", "0:0.1:1")
        results = [
            solve(problem, "--method", method, *at)
            for method in ("event-driven", "exponential-integrator", "laplace-iteration")
        ]
        for other in results[1:]:
            for kind in ("x", "y", "w"):
                for name, values in getattr(results[0], kind).items():
                    np.testing.assert_allclose(getattr(other, kind)[name], values, rtol=0, atol=2e-6)

    def test_agrees_with_scipy(self):
        cells, c, horizon = 16, 0.2, 0.3
        size, dx = cells - 1, 1 / cells
        along = np.arange(1, cells) * dx
        D = sparse.diags([1, -2, 1], [-1, 0, 1], (size, size)).toarray()
        # V[q, p] at (p dx, q dx): second differences in both directions.
        x0 = 20 * np.outer(along * (1 - along), along * (1 - along))
        M = 2 * np.eye(size) - D

        def on_membrane(V, t):
            """V(0, .): the LCP for y = V - psi by pivoting, which is finite for an M-matrix."""
            psi = np.where(np.abs(along - 0.5) <= 0.25, np.sin(4 * np.pi * t), np.sin(2 * np.pi * t))
            q = M @ psi - 2 * V[:, 0]
            free = np.zeros(size, dtype=bool)
            while True:
                y = np.zeros(size)
                y[free] = np.linalg.solve(M[np.ix_(free, free)], -q[free])
                more = q + M @ y < -1e-13
                if not np.any(more & ~free):
                    return y + psi
                free |= more

        def slope(t, flat):
            V = flat.reshape(size, size)
            result = D @ V + V @ D
            result[:, 0] += on_membrane(V, t)
            return c / dx**2 * result.ravel()

        jacobian = c / dx**2 * (np.kron(D, np.eye(size)) + np.kron(np.eye(size), D))
        reference = solve_ivp(slope, (0, horizon), x0.ravel(), "Radau", rtol=1e-8, atol=1e-9, jac=jacobian)
        result = solve(self.model(cells, horizon), "--tolerance", "1e-7", "--at", str(horizon))
        x = np.array([values[0] for values in result.x.values()])
        np.testing.assert_allclose(x, reference.y[:, -1], rtol=0, atol=1e-6)

    def test_grids_give_the_values_of_the_guide(self):
        text = (PROJECT / "client/guide/README.md").read_text()
        shown = [float(cell) for cell in text.split("\n| V | ")[1].split("\n")[0].strip(" |").split(" | ")]
        values = []
        for cells in (8, 16, 32, 64):
            result = solve(self.model(cells, 0.3), "--tolerance", "1e-5", "--at", "0.3")
            index = (cells // 2 - 1) * (cells - 1) + cells // 4
            values.append(result.x[f"x{index}"][0])
        np.testing.assert_allclose(values, shown, atol=6e-5)
        changes = np.diff(values)
        self.assertAlmostEqual(changes[1] / changes[2], 2, delta=0.2)  # first order in the end


class AmericanPutTest(unittest.TestCase):
    STRIKE, RATE, VOLATILITY = 100, 0.1, 0.2

    def exact(self, price):
        """Trees of an even and an odd number of steps err to both sides."""
        return (self.tree(price, 10_000) + self.tree(price, 10_001)) / 2

    def tree(self, price, steps):
        """The binomial tree of Cox, Ross and Rubinstein for one year."""
        dt = 1 / steps
        up = np.exp(self.VOLATILITY * np.sqrt(dt))
        discount = np.exp(-self.RATE * dt)
        p = (1 / discount - 1 / up) / (up - 1 / up)
        value = np.maximum(self.STRIKE - price * up ** (steps - 2.0 * np.arange(steps + 1)), 0)
        for k in range(steps - 1, -1, -1):
            value = discount * (p * value[:-1] + (1 - p) * value[1:])
            value = np.maximum(value, self.STRIKE - price * up ** (k - 2.0 * np.arange(k + 1)))
        return value[0]

    def problem(self, step):
        program = [sys.executable, str(EXAMPLES / "american_put.py"), str(step)]
        return subprocess.run(program, capture_output=True, text=True, check=True).stdout

    def test_the_file_is_what_the_program_writes(self):
        self.assertEqual(self.problem(1), (EXAMPLES / "american-put.json").read_text())

    def test_tends_to_the_value_of_a_binomial_tree(self):
        coarse, fine = (solve(self.problem(step), "--at", "1").x for step in (2, 1))
        exact_at = {price: self.exact(price) for price in (90, 100, 110)}
        self.assertAlmostEqual(exact_at[100], 4.8163, delta=6e-5)
        self.assertAlmostEqual(exact_at[90], 10.430, delta=6e-4)
        for price, exact in exact_at.items():
            name = f"V{price}"
            error = abs(fine[name][0] - exact)
            self.assertLess(error, 5e-3)
            # The error of the grid is of order 2, beside the boundary of order 1.
            extrapolated = fine[name][0] + (fine[name][0] - coarse[name][0]) / 3
            self.assertLess(abs(extrapolated - exact), error / 2)

    def test_values_are_those_of_the_guide(self):
        # The work allowed by default ends before the errors of the finest grid are below its tolerance.
        steps = ("--method", "exponential-integrator", "--steps", "1024")
        for step, value, options in ((2, 4.8030, ()), (1, 4.8132, ()), (0.5, 4.8155, steps)):
            put = solve(self.problem(step), "--at", "1", *options)
            self.assertAlmostEqual(put.x["V100"][0], value, delta=6e-5)

    def test_is_exercised_below_the_boundary_of_the_literature(self):
        result = solve(EXAMPLES / "american-put.json", "--at", "0.25,1")
        at_end = {name: values[-1] for name, values in result.y.items()}
        self.assertGreater(at_end["S86"], 0)  # 86.27 lies between the two
        self.assertEqual(at_end["S87"], 0)
        self.assertAlmostEqual(at_end["S82"], self.RATE * self.STRIKE, delta=1e-6)


class DryFrictionTest(unittest.TestCase):
    OMEGA, LIMIT, T = 0.4, 0.5, 50

    def motion(self):
        """The switching times, and the positions at which the block stops: each phase in closed form."""
        switches, stops = [], []
        begin, x = 0.0, 0.0
        while True:
            # At rest until the force exceeds the limit.
            def excess(t, x=x):
                return abs(np.sin(self.OMEGA * t) - x) - self.LIMIT

            fine = np.linspace(begin, begin + 2 * np.pi / self.OMEGA, 4001)[1:]
            after = fine[np.argmax(excess(fine) > 0)]
            start = brentq(excess, after - (fine[1] - fine[0]), after, xtol=1e-15) if excess(begin) < 0 else begin
            if start > self.T:
                return switches, stops
            switches.append(start)
            # x'' = -x + sin(OMEGA t) - sign LIMIT from rest, until the speed is 0 again.
            sign = np.sign(np.sin(self.OMEGA * after) - x)
            gain = 1 / (1 - self.OMEGA**2)
            a = x + sign * self.LIMIT - gain * np.sin(self.OMEGA * start)
            b = -gain * self.OMEGA * np.cos(self.OMEGA * start)

            def speed(t, start=start, a=a, b=b):
                return -a * np.sin(t - start) + b * np.cos(t - start) + gain * self.OMEGA * np.cos(self.OMEGA * t)

            fine = np.linspace(start, start + 2 * np.pi, 4001)[2:]
            after = fine[np.argmax(sign * speed(fine) < 0)]
            begin = brentq(speed, after - (fine[1] - fine[0]), after, xtol=1e-15)
            if begin > self.T:
                return switches, stops
            x = a * np.cos(begin - start) + b * np.sin(begin - start) - sign * self.LIMIT
            x += gain * np.sin(self.OMEGA * begin)
            switches.append(begin)
            stops.append(x)

    def test_sticks_and_slips_at_the_times_of_the_closed_form(self):
        switches, stops = self.motion()
        self.assertAlmostEqual(switches[0], np.arcsin(self.LIMIT) / self.OMEGA, delta=1e-14)
        result = solve(EXAMPLES / "dry-friction.json")
        self.assertEqual(len(switches), 13)
        np.testing.assert_allclose(result.switches[1:], switches, rtol=0, atol=2e-8)
        # The block rests exactly where it stops.
        rests = solve(EXAMPLES / "dry-friction.json", "--at", times([s + 0.5 for s in switches[1::2]]))
        np.testing.assert_allclose(rests.x["position"], stops, rtol=0, atol=1e-8)
        np.testing.assert_array_equal(rests.x["speed"], 0)

    def test_has_the_amplitude_of_den_hartog(self):
        for beta, limit in ((0.4, 0.1), (2 / 3, 0.2), (0.75, 0.3), (1.5, 0.2), (2.5, 0.5)):
            problem = example("dry-friction.json", omega=beta, limit=limit, T=60 * 2 * np.pi / beta)
            turns = solve(problem, "--tolerance", "1e-9").switches[-2:]
            positions = solve(problem, "--tolerance", "1e-9", "--at", times(turns)).x["position"]
            v = 1 / (1 - beta**2)
            u = np.sin(np.pi / beta) / (beta * (1 + np.cos(np.pi / beta)))
            np.testing.assert_allclose(np.abs(positions), np.sqrt(v**2 - (limit * u) ** 2), rtol=0, atol=1e-6)


class EconomyTest(unittest.TestCase):
    def test_is_two_linear_systems_in_turn(self):
        model = json.loads((EXAMPLES / "input-output.json").read_text())
        A, B, C = (np.array(model[key]) for key in "ABC")
        T = model["T"]

        def supply(x, stopped):
            active = [0, 2] if stopped else [0, 1, 2]
            y = np.zeros(3)
            y[active] = np.linalg.solve((np.eye(3) - C)[np.ix_(active, active)], x[active])
            return y

        def power(x, stopped):
            """The quantity that decides: the production of power, or its surplus with the opposite sign."""
            y = supply(x, stopped)
            return -(y - C @ y - x)[1] if stopped else y[1]

        t, x, stopped, switches, at, states = 0.0, np.array(model["d"], float), False, [], [], []
        kinks = [0.5 * k for k in range(1, 7)]
        while t < T:
            end = min(k for k in kinks if k > t + 1e-12)

            def slope(t, x, stopped=stopped, sun=int(2 * t + 1e-9) % 2 == 0):
                f = [8, 16 - (60 * np.sin(2 * np.pi * t) if sun else 0), 12]
                return A @ x + B @ supply(x, stopped) + f

            def event(t, x, stopped=stopped):
                return power(x, stopped)

            event.terminal, event.direction = True, 1 if stopped else -1
            run_ = solve_ivp(slope, (t, end), x, "DOP853", rtol=1e-12, atol=1e-12, events=event)
            t, x = run_.t[-1], run_.y[:, -1]
            if run_.status == 1:
                switches.append(t)
                stopped = not stopped
            else:
                at.append(t)
                states.append(x)
        result = solve(run("model", "input-output", str(EXAMPLES / "input-output.json")), "--at", times(at))
        self.assertEqual(len(switches), 6)
        np.testing.assert_allclose(result.switches[1:], switches, rtol=0, atol=1e-8)
        np.testing.assert_allclose(np.array(list(result.x.values())).T, states, rtol=0, atol=1e-8)

    def test_has_no_solution_if_it_is_not_productive(self):
        model = json.loads((EXAMPLES / "input-output.json").read_text())
        model["C"] = [[0.8, 0, 0.1], [0.2, 0.1, 0.3], [0.6, 0.2, 0.7]]
        problem = run("model", "input-output", "-", text=json.dumps(model))
        done = subprocess.run([DLCS, "solve", "-"], input=problem, capture_output=True, text=True)
        self.assertEqual(done.returncode, 1)
        self.assertIn("INFEASIBLE", done.stdout)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
