#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Switching circuits: ngspice beside `dlcs solve`, and the periodic steady state beside the transient.

Usage: spice_bench.py DLCS [CASE...]

Needs ngspice of Debian and numpy. Both programs read the same decks, with diodes as each of them has them. Each is
compared with its own settled answer: that of `dlcs` with --tolerance 1e-9; that of ngspice with the finest settings
with which it does not stop with "timestep too small", and how far that is from the one with the next finest. The error
is the largest difference of all outputs at 200 times, relative to the largest value of the output. The quickest
settings with an error of at most 1e-4 count; of ngspice all of its steps and RELTOLS are tried. Wall time is that of
the whole program, the best of RUNS, with its results in a binary file; of `dlcs` also that of the solve alone.

The second table: a rectifier that settles in N periods, by --periodic and by N periods; processor time of one thread.
Reports are tables in Markdown; progress goes to standard error.
"""

import itertools
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import time

import numpy as np

GOAL = 1e-4
RUNS = 5
RELTOLS = ("1e-3", "1e-4", "1e-5")
TOLERANCES = ("1e-3", "1e-4", "1e-5")

# deck, T, outputs, largest steps of ngspice from the finest on
CASES = {
    "buck, 50 kHz, 20 ms": ("""
Vin in 0 24
Vg g 0 PULSE(0 5 0 10n 10n 9.99u 20u)
S1 in sw g 0 SX
D1 0 sw DX
L1 sw out 47u
C1 out 0 100u
R1 out 0 10
.model SX SW(RON=0.01 VT=2.5 VH=0.5)
.ic v(out)=0
""", 0.02, ["v(out)", "i(L1)"], [1e-8, 2e-8, 5e-8, 1e-7, 2e-7, 5e-7, 1e-6, 2e-6, 5e-6]),
    "three-phase rectifier, 200 ms": ("""
Va a1 0 SIN(0 325 50)
Vb b1 0 SIN(0 325 50 0 0 -120)
Vc c1 0 SIN(0 325 50 0 0 120)
La a1 a 1m
Lb b1 b 1m
Lc c1 c 1m
Rab a ab 100
Cab ab b 100n
Rbc b bc 100
Cbc bc c 100n
Rca c ca 100
Cca ca a 100n
D1 a p DX
D3 b p DX
D5 c p DX
D4 n a DX
D6 n b DX
D2 n c DX
C1 p n 1000u
R1 p n 50
""", 0.2, ["v(p,n)", "i(La)", "i(Lb)"], [2e-7, 5e-7, 1e-6, 2e-6, 5e-6, 1e-5, 2e-5, 5e-5]),
    "full bridge with dead time, 20 kHz, 20 ms": ("""
Vdc p 0 400
S1 p a g1 0 SX
S2 a 0 g2 0 SX
S3 p b g2 0 SX
S4 b 0 g1 0 SX
D1 a p DX
D2 0 a DX
D3 b p DX
D4 0 b DX
L1 a c 1m
R1 c b 10
Vg1 g1 0 PULSE(0 5 0.5u 10n 10n 23.98u 50u)
Vg2 g2 0 PULSE(0 5 25.5u 10n 10n 23.98u 50u)
.model SX SW(RON=0.02 VT=2.5)
""", 0.02, ["i(L1)"], [1e-8, 2e-8, 5e-8, 1e-7, 2e-7, 5e-7, 1e-6, 2e-6, 5e-6]),
}
DIODE = ".model DX D(IS=1e-9 RS=10m)"


def timed(command, folder):
    begin = time.perf_counter()
    run = subprocess.run(command, cwd=folder, capture_output=True, check=False, timeout=600)
    return time.perf_counter() - begin, run.returncode


def parts(output):
    """The vectors that both programs save, with signs."""
    return [(f"{output[0]}({name})", sign) for name, sign in zip(output[2:-1].split(","), (1, -1))]


def values_in(path, outputs, times):
    """The outputs at `times`, one in each column, from a raw file."""
    head, data = path.read_bytes().split(b"Binary:\n", 1)
    count = int(re.search(rb"No\. Points:\s*(\d+)", head)[1])
    names = [line.split()[1].decode().lower() for line in head.split(b"Variables:\n")[1].strip().splitlines()]
    table = np.frombuffer(data, dtype=float, count=count * len(names)).reshape(count, len(names))
    if not count or table[-1, 0] < times[-1]:
        return None  # "timestep too small"
    columns = [
        sum(sign * np.interp(times, table[:, 0], table[:, names.index(part.lower())]) for part, sign in parts(output))
        for output in outputs
    ]
    return np.array(columns).T


class Case:
    def __init__(self, dlcs, folder, name):
        self.dlcs, self.folder = dlcs, folder
        self.lines, self.stop, self.outputs, self.steps = CASES[name]
        # Not at edges: between them the answers of ngspice are interpolated.
        self.times = self.stop * (np.arange(200) + 0.6180339887) / 200

    def deck(self, largest, options=""):
        uic = " uic" if "SIN" in self.lines else ""
        tran = f".tran {self.stop / 1000:g} {self.stop:g} 0 {largest:g}{uic}"
        saved = " ".join(vector for output in self.outputs for vector, _ in parts(output))
        lines = ["title" + self.lines + DIODE, tran, options, ".save " + saved]
        (self.folder / "deck.cir").write_text("\n".join([*lines, ".end"]) + "\n")

    def by_spice(self, step, reltol, runs=1):
        self.deck(step, f".options reltol={reltol}")
        seconds = min(timed(["ngspice", "-b", "deck.cir", "-r", "out.raw"], self.folder)[0] for _ in range(runs))
        return seconds, values_in(self.folder / "out.raw", self.outputs, self.times)

    def by_dlcs(self, tolerance, runs=1):
        self.deck(0)
        at = ",".join(repr(float(t)) for t in self.times)
        command = [self.dlcs, "solve", "deck.cir", "--tolerance", tolerance, "--at", at, "--threads", "1", "--quiet",
                   "--format", "raw", "--output", "out.raw"]  # fmt: skip
        done = [timed(command, self.folder) for _ in range(runs)]
        assert not any(code for _, code in done), "not solved"
        return min(seconds for seconds, _ in done), values_in(self.folder / "out.raw", self.outputs, self.times)

    def solve_alone(self, tolerance):
        command = [self.dlcs, "solve", "deck.cir", "--tolerance", tolerance, "--at", repr(self.stop), "--threads", "1",
                   "--quiet", "--format", "json"]  # fmt: skip
        runs = [subprocess.run(command, cwd=self.folder, capture_output=True, check=True) for _ in range(RUNS)]
        return min(json.loads(run.stdout)["summary"]["cost"]["seconds_total"] for run in runs)


def apart(one, other):
    return (abs(one - other).max(axis=0) / abs(other).max(axis=0)).max()


def report(dlcs, name):
    with tempfile.TemporaryDirectory() as folder:
        case = Case(dlcs, pathlib.Path(folder), name)
        # It may stop with "timestep too small", at any step.
        fine = itertools.product(case.steps, ("1e-6", *reversed(RELTOLS)))
        answers = ((step, case.by_spice(step, reltol)[1]) for step, reltol in fine)
        good_ones = ((step, values) for step, values in answers if values is not None)
        finest, settled = next(good_ones)
        moved = apart(next(good_ones)[1], settled)
        good = []
        for step in [step for step in case.steps if step > finest]:
            for reltol in RELTOLS:
                seconds, values = case.by_spice(step, reltol)
                error = np.inf if values is None else apart(values, settled)
                print(f"    {step:g} {reltol} {seconds:.3f} {error:.2e}", file=sys.stderr)
                if error <= GOAL:
                    good.append((seconds, step, reltol, error))
        _, ours_settled = case.by_dlcs("1e-9")
        ours = []
        for tolerance in TOLERANCES:
            seconds, values = case.by_dlcs(tolerance, RUNS)
            error = apart(values, ours_settled)
            print(f"    {tolerance} {seconds:.3f} {error:.2e}", file=sys.stderr)
            if error <= GOAL:
                ours.append((seconds, tolerance, error))
        own, tolerance, own_error = min(ours)
        alone = case.solve_alone(tolerance)
        told = f"{own * 1e3:.0f} ms ({alone * 1e3:.0f} ms), {own_error:.0e} (tolerance {tolerance})"
        if not good:
            print(f"| {name} | – | {told} | – | {moved:.0e} |", flush=True)
            return
        _, step, reltol, error = min(good)
        seconds, _ = case.by_spice(step, reltol, RUNS)
        print(f"| {name} | {seconds * 1e3:.0f} ms, {error:.0e} (step {step:g}, reltol {reltol}) | {told} "
              f"| {seconds / own:.1f} ({seconds / alone:.1f}) | {moved:.0e} |", flush=True)  # fmt: skip


def rectifier(periods):
    """Settles to 1e-6 in so many periods of 1 s."""
    capacity = periods / math.log(1e6) / 50
    lines = ["title", "V1 in 0 SIN(0 10 1)", "D1 in a DX", "C1 a 0 1", "L1 a b 1", "R1 b c 2", f"C2 c 0 {capacity!r}",
             "RL c 0 50", ".model DX D(VFWD=0 RON=50)", f".tran 1 {periods} uic", ".print v(c)", ".end"]  # fmt: skip
    return "\n".join(lines) + "\n"


def solve_rectifier(dlcs, path, *options):
    command = [dlcs, "solve", path, "--tolerance", "1e-6", "--threads", "1", "--quiet", "--format", "json", *options]
    result = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    return result["summary"], result["outputs"]["v(c)"][-1]


def report_periodic(dlcs, periods):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "deck.cir"
        path.write_text(rectifier(periods))
        runs = [solve_rectifier(dlcs, path, "--periodic", "1") for _ in range(RUNS)]
        steady, volts = min(runs, key=lambda run: run[0]["cost"]["seconds_total"])
        transient, settled = solve_rectifier(dlcs, path, "--at", str(periods))
    assert abs(volts - settled) <= 1e-5 * abs(settled), "the transient ends elsewhere"
    own, other = steady["cost"]["seconds_total"], transient["cost"]["seconds_total"]
    print(f"| {periods:,} | {own * 1e3:.1f} ms, {steady['periodic']['periods']} periods | {other * 1e3:.0f} ms "
          f"| {other / own:.0f} | {periods / 25:.0f} |", flush=True)  # fmt: skip


if __name__ == "__main__":
    print("| circuit | ngspice: wall time, error | dlcs (the solve alone), error | ratio | ngspice's answer moves by |")
    print("| --- | --- | --- | --- | --- |")
    for chosen in sys.argv[2:] or CASES:
        report(sys.argv[1], chosen)
    print("\n| periods N of the transient | steady state | transient | ratio | goal N/25 |")
    print("| --- | --- | --- | --- | --- |")
    for count in (1_000, 100_000):
        report_periodic(sys.argv[1], count)
