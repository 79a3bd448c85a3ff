#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""dlcs and ngspice solve the same decks. The steps of ngspice are refined until its own answer has settled: the
difference to its answer with four times the step is subtracted, since it converges like the step.

Diodes of decks become switches that their own voltage controls, which both programs take as the same element; or
ngspice has a current source whose straight lines are those of VFWD and RON.

    ngspice_peer_test.py DLCS DECKS_FOLDER
"""

import csv
import json
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy

DLCS, DECKS = sys.argv[1], pathlib.Path(sys.argv[2])
OPTIONS = "reltol=1e-7 abstol=1e-12 vntol=1e-9 chgtol=1e-18"


def with_switches_for_diodes(deck, ohms, stop):
    deck = re.sub(r"^D(\w+) (\S+) (\S+) D\w$", r"SD\1 \2 \3 \2 \3 SWD", deck, flags=re.M)
    deck = re.sub(r"^\.model D\w .*$", f".model SWD SW(RON={ohms} ROFF=1meg VT=0)", deck, flags=re.M)
    deck = re.sub(r"(SW\(RON=\S+) VT", r"\1 ROFF=1meg VT", deck)
    deck = re.sub(r" i\(D\w+\)", "", deck, flags=re.I)
    return re.sub(r"^(\.tran \S+) \S+", rf"\1 {stop}", deck, flags=re.M)


def with_sources_for_diodes(deck):
    """The same circuit for ngspice, which does not know VFWD and RON; a leak holds nodes that all diodes leave."""
    volts, ohms = re.search(r"^\.model DX D\(VFWD=(\S+) RON=(\S+)\)$", deck, flags=re.M).groups()
    deck = re.sub(r"^\.model DX .*\n", "", deck, flags=re.M)
    line = rf"B\1 \2 \3 I = (V(\2,\3) > {volts} ? (V(\2,\3) - {volts})/{ohms} : 0) + V(\2,\3)/1e10"
    return re.sub(r"^D(\w+) (\S+) (\S+) DX$", line, deck, flags=re.M)


# All diodes block at the start, and their leaks, which are equal, divide the 6 V.
BLOCKING = """Three diodes in series that block
V1 a 0 PULSE(6 7 1u 1u 1u 1 2)
D1 b a DX
D2 c b DX
D3 0 c DX
C1 b 0 1u
C2 c 0 1u
.model DX D(IS=1e-14)
.tran 1u 5u
.print tran v(b) v(c)
.end
"""

# Sources that rise within 20 us, as LTspice has it; a resistor of a sheet; controlled sources with their kind.
STARTUP = """Sources that rise
V1 a 0 5
V2 g 0 PULSE(0 3 5u 1u 1u 8u 20u)
R1 a b RX L=100u
C1 b 0 10n
E1 c 0 VCVS VALUE={2*V(b)}
E2 d c VCVS g 0 3
R2 d e 1k
C2 e 0 5n
.model RX R(RSH=20 DEFW=2u)
.tran 1n 100u startup
.print tran v(b) v(d) v(e)
.end
"""

# Products with the voltage of a supply, which comes last: in a subcircuit, a quotient, and a product of POLY.
SUPPLY = """Products with a supply
X1 vcc in q flag cell
.subckt cell rail in q flag
R1 rail ref 5k
R2 ref 0 5k
B1 q 0 V={0.5*V(rail)*(1 + V(flag)) - V(in)*V(rail)/10 + V(ref)/V(rail)}
E1 flag 0 POLY(2) in 0 rail 0 0.1 0 0 0 0.02
.ends
R3 q in 10k
C1 in 0 100n
R4 s in 20k
V2 s 0 SIN(0 1 1k)
V1 vcc 0 DC 5
.tran 10u 3m
.print tran v(in) v(q) v(flag)
.end
"""

PUMP = """Dickson charge pump
Vdd vdd 0 5
V1 c1 0 PULSE(0 5 0 10n 10n 0.49u 1u)
V2 c2 0 PULSE(5 0 0 10n 10n 0.49u 1u)
D1 vdd n1 DX
D2 n1 n2 DX
D3 n2 n3 DX
D4 n3 out DX
C1 c1 n1 10n
C2 c2 n2 10n
C3 c1 n3 10n
C4 out 0 100n
R1 out 0 10k
.model DX D(VFWD=0.4 RON=5)
.tran 10n 20u
.print tran v(out)
.end
"""

# A phase that does not conduct has neither a voltage of its own nor a current.
THREE_PHASES = """Three-phase rectifier with source inductances and a load of R and L
Va a1 0 SIN(0 325 50)
Vb b1 0 SIN(0 325 50 0 0 -120)
Vc c1 0 SIN(0 325 50 0 0 120)
La a1 a 1m
Lb b1 b 1m
Lc c1 c 1m
D1 a p DX
D3 b p DX
D5 c p DX
D4 n a DX
D6 n b DX
D2 n c DX
R1 p q 10
L1 q n 20m
Rn n 0 1Meg
.model DX D(VFWD=0.7 RON=10m)
.tran 10u 20m uic
.print tran i(L1) i(La)
.end
"""


def random_circuit(seed):
    """R, L, C, diodes and a switch or two between three to six nodes, each of which leaks to ground."""
    generator = random.Random(seed)
    nodes = ["0", *(f"n{k}" for k in range(1, generator.randint(3, 6)))]
    lines = [f"random circuit {seed}", "Vg g 0 PULSE(0 1 20u 1u 1u 80u 190u)"]
    lines += [generator.choice(["V1 n1 0 SIN(0 10 1k)", "V1 n1 0 PULSE(-5 10 0 5u 5u 300u 700u)"])]

    def add(plus, minus):
        name = f"{len(lines)} {plus} {minus}"
        kind = generator.choices("RLCDS", [6, 3, 4, 5, 2])[0]
        low, high = {"R": (0, 3), "L": (-4.5, -2), "C": (-7.5, -5)}.get(kind, (0, 0))
        value = f"{10 ** generator.uniform(low, high):.4g}"
        lines.append({"D": f"D{name} DX", "S": f"S{name} g 0 SX"}.get(kind, f"{kind}{name} {value}"))

    for k in range(2, len(nodes)):
        add(nodes[k], nodes[generator.randrange(k)])
        lines.append(f"Rleak{k} {nodes[k]} 0 {generator.choice(['10k', '100k'])}")
    for _ in range(2 * len(nodes)):
        pair = generator.sample(nodes, 2)
        if set(pair) != {"n1", "0"}:
            add(*pair)
    lines += ["V2 x 0 SIN(0 3 3k)", f"Rx x {nodes[-1]} 1k", f".model DX D(VFWD=0.5 RON={generator.choice([0.02, 1])})"]
    lines += [".model SX SW(RON=0.1 ROFF=1Meg VT=0.5)", ".tran 10u 2m uic"]
    lines += [".print tran " + " ".join(f"v({node})" for node in nodes[2:]), ".end"]
    return "\n".join(lines) + "\n"


def solve(deck, times, folder):
    path = folder / "deck.cir"
    path.write_text(deck)
    at = ",".join(repr(float(time)) for time in times)
    arguments = [DLCS, "solve", path, "--tolerance", "1e-7", "--format", "csv", "--at", at, "--quiet"]
    run = subprocess.run(arguments, capture_output=True, text=True, check=True)
    rows = list(csv.reader(run.stdout.splitlines()))
    return [name.lower() for name in rows[0][1:]], numpy.array([[float(x) for x in row[1:]] for row in rows[1:]])


def vectors(name):
    """The vectors that ngspice saves for an output, with signs."""
    inside = name[2:-1].split(",")
    return [(f"{name[0]}({part})", sign) for part, sign in zip(inside, (1, -1))]


def spice(deck, names, step, times, folder, options=OPTIONS):
    lines = [line for line in deck.splitlines() if not re.match(r"\.(print|end)\b", line)]
    lines = [re.sub(r"^(\.tran \S+ \S+)", rf"\1 0 {step:g}", line) for line in lines]
    saved = sorted({vector for name in names for vector, _ in vectors(name)})
    lines += [f".options {options}", ".save " + " ".join(saved), ".end"]
    (folder / "spice.cir").write_text("\n".join(lines) + "\n")
    subprocess.run(
        ["ngspice", "-b", "spice.cir", "-r", "out.raw"], cwd=folder, capture_output=True, check=True, timeout=120
    )
    head, data = (folder / "out.raw").read_bytes().split(b"Binary:\n", 1)
    columns = [line.split()[1].decode().lower() for line in head.split(b"Variables:\n")[1].strip().splitlines()]
    values = numpy.frombuffer(data, dtype=float)
    values = values[: len(values) // len(columns) * len(columns)].reshape(-1, len(columns))

    def interpolated(vector):
        return numpy.interp(times, values[:, 0], values[:, columns.index(vector)])

    return numpy.array([sum(sign * interpolated(vector) for vector, sign in vectors(name)) for name in names]).T


@unittest.skipUnless(shutil.which("ngspice"), "ngspice is not installed")
class NgspicePeerTest(unittest.TestCase):
    def compare(self, deck, stop, step, agreement, for_spice=None, options=OPTIONS):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            # Not at edges, between which the answers of ngspice are interpolated.
            times = stop * (numpy.arange(37) + 0.6180339887) / 37
            names, ours = solve(deck, times, folder)
            kept = [k for k, output in enumerate(names) if output[0] == "v" or output[2] in "lv"]  # what ngspice saves
            names, ours = [names[k] for k in kept], ours[:, kept]
            coarse = spice(for_spice or deck, names, 4 * step, times, folder, options)
            fine = spice(for_spice or deck, names, step, times, folder, options)
        size = abs(ours).max(axis=0)
        settled = abs(fine - coarse).max(axis=0) / size
        difference = abs(fine - ours).max(axis=0) / size
        for k, output in enumerate(names):
            self.assertLess(settled[k], 3 * agreement, f"{output}: ngspice itself has not settled")
            self.assertLess(difference[k], agreement, f"{output}: ngspice moved by {settled[k]:.2g}")

    def test_resistors_inductors_capacitors_and_sources(self):
        for name in ("rlc", "transformer"):
            with self.subTest(name):
                self.compare((DECKS / f"{name}.cir").read_text(), 0.02, 1e-7, 1e-6)

    def test_rectifiers(self):
        for name, stop in (("half-wave", 0.03), ("bridge", 0.02), ("doubler", 0.02)):
            with self.subTest(name):
                deck = with_switches_for_diodes((DECKS / f"{name}.cir").read_text(), 0.01, stop)
                self.compare(deck, stop, 1e-7, 1e-5)

    def test_diodes_of_the_same_characteristic(self):
        self.compare(PUMP, 2e-5, 1e-9, 1e-5, with_sources_for_diodes(PUMP))
        loose = "reltol=1e-5 abstol=1e-6 vntol=1e-5 chgtol=1e-12"  # with others it stops with "timestep too small"
        self.compare(THREE_PHASES, 0.02, 1e-6, 1e-5, with_sources_for_diodes(THREE_PHASES), loose)

    def test_sources_that_rise_and_parts_with_models(self):
        risen = re.sub(r"^V1 .*", "B1 a 0 V=5*min(1, time/20u)", STARTUP.replace(" startup", ""), flags=re.M)
        risen = risen.replace("V2 g 0", "B2 g 0 V=V(p)*min(1, time/20u)\nV2 p 0")
        self.compare(STARTUP, 1e-4, 1e-9, 1e-6, risen)

    def test_products_with_a_supply(self):
        self.compare(SUPPLY, 3e-3, 1e-7, 1e-6)

    def test_where_blocking_diodes_leave_the_operating_point_open(self):
        self.compare(BLOCKING, 5e-6, 1e-9, 1e-5)

    def test_random_circuits(self):
        """ngspice finds switchings to a part of its steps: some 1e-4 of the result."""
        loose = "reltol=1e-5 abstol=1e-9 vntol=1e-7 chgtol=1e-15"
        for seed in range(12):
            with self.subTest(seed=seed):
                deck = random_circuit(seed)
                self.compare(deck, 0.002, 2.5e-8, 1e-3, with_sources_for_diodes(deck), loose)

    def test_converters(self):
        for name in ("buck", "boost", "buck-boost", "half-bridge", "snubber"):
            with self.subTest(name):
                deck = with_switches_for_diodes((DECKS / f"{name}.cir").read_text(), 0.01, 6e-5)
                self.compare(deck, 6e-5, 5e-10, 1e-5)

    def test_a_switch_that_the_circuit_controls(self):
        """ngspice finds the time at which it switches between its steps to some 1e-5 of the result."""
        deck = with_switches_for_diodes((DECKS / "hysteretic-buck.cir").read_text(), 0.02, 2e-4)
        self.compare(deck, 2e-4, 1e-9, 3e-5)

    def test_transistors(self):
        """Of a MOSFET a switch and a straight line for its body diode remain: some tenths of a percent."""
        deck = re.sub(r"^(\.tran \S+) \S+", r"\1 100u", (DECKS / "mosfet-buck.cir").read_text(), flags=re.M)
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            times = 1e-4 * (numpy.arange(37) + 0.618) / 37
            names, ours = solve(deck, times, folder)
            theirs = spice(deck, names, 5e-9, times, folder, options="reltol=1e-5")
        for output in ("v(out)", "i(l1)"):
            k = names.index(output)
            self.assertLess(abs(theirs - ours)[:, k].max(), 5e-3 * abs(ours[:, k]).max(), output)

    def test_ngspice_loads_the_raw_file(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            deck = (DECKS / "rlc.cir").read_text()
            names, ours = solve(deck, [0.001, 0.002, 0.003], folder)
            arguments = [DLCS, "solve", folder / "deck.cir", "--tolerance", "1e-8", "--at", "0.001,0.002,0.003"]
            subprocess.run([*arguments, "--output", folder / "ours.raw", "--quiet"], check=True, capture_output=True)
            lines = ["title", ".control", "load ours.raw", "set numdgt=14", "set width=200"]
            lines += [f"print {' '.join(names)}", "quit", ".endc", ".end"]
            (folder / "load.cir").write_text("\n".join(lines) + "\n")
            run = subprocess.run(["ngspice", "-b", "load.cir"], cwd=folder, capture_output=True, text=True, timeout=60)
            rows = [line.split()[1:] for line in run.stdout.splitlines() if re.match(r"^\d+\s", line)]
            theirs = numpy.array([[float(number) for number in row] for row in rows])
            self.assertEqual(theirs.shape, ours.shape, run.stdout + run.stderr)
            self.assertLess(abs(theirs - ours).max(), 1e-12 * abs(ours).max())

    def test_measurements(self):
        """The measurements of both programs for the same deck."""
        measurements = [
            "mean AVG v(out) FROM=1m TO=5m",
            "effective RMS v(out) FROM=1m TO=5m",
            "most MAX v(out)",
            "crossed WHEN v(out)=0.5 RISE=1",
            "now FIND v(out) AT=2m",
            "late TRIG v(out) VAL=0.2 RISE=1 TARG v(out) VAL=0.8 RISE=1",
        ]
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            lines = ["title", "V1 in 0 PULSE(0 1 0 1m 1m 2m 8m)", "R1 in a 10", "L1 a out 1m", "C1 out 0 10u"]
            lines += [".tran 1u 6m 0 0.1u", *(f".meas tran {one}" for one in measurements), ".end"]
            (folder / "deck.cir").write_text("\n".join(lines) + "\n")
            run = subprocess.run(["ngspice", "-b", "deck.cir"], cwd=folder, capture_output=True, text=True, timeout=120)
            ours = subprocess.run(
                [DLCS, "solve", folder / "deck.cir", "--tolerance", "1e-9", "--format", "json", "--quiet"],
                capture_output=True, text=True, check=True,
            )
            for one in json.loads(ours.stdout)["summary"]["measurements"]:
                with self.subTest(one["name"]):
                    theirs = float(re.search(rf"^{one['name']}\s*=\s*(\S+)", run.stdout, re.M)[1])
                    self.assertAlmostEqual(one["value"] / theirs, 1, delta=2e-5)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
