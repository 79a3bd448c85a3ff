# SPDX-License-Identifier: Apache-2.0
"""Files of arrays that `dlcs` and other programs exchange: NumPy, SciPy and h5py read its results, and write problems
and matrices for it. Every double keeps its bits.

    array_files_test.py DLCS EXAMPLES_FOLDER
"""

import io
import json
import os
import pathlib
import random
import resource
import struct
import subprocess
import sys
import tempfile
import unittest
import zipfile
import zlib

import h5py
import numpy as np
import scipy.io
import scipy.sparse

DLCS, EXAMPLES = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith("DLCS_")}
ENVIRONMENT["XDG_CONFIG_HOME"] = "/nonexistent"

# Every number that is not an integer has digits that a 32-bit float cannot hold.
SYSTEM = {
    "A": np.array([[-1.1, 0.3], [0.0, -2.0]]),
    "B": np.array([[1.0], [0.5]]),
    "N": np.array([[1.0, 0.1]]),
    "M": np.array([[2.0]]),
    "E": np.array([[1.7, 0.4], [0.2, 1.1]]),
    "f": np.array([0.7, -0.1]),
    "g": np.array([-1.3]),
    "x0": np.array([1.0, 1 / 3]),
    "T": np.array(2.5),
}
INTEGERS = {name: np.round(2 * value).astype(np.int8) for name, value in SYSTEM.items()}


def run(*arguments, folder, **options):
    return subprocess.run(
        [DLCS, *map(str, arguments)], cwd=folder, env=ENVIRONMENT, capture_output=True, check=False, **options
    )


def bits(values):
    return np.ascontiguousarray(values, dtype=np.float64).tobytes()


class ArrayFilesTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def dlcs(self, *arguments):
        done = run(*arguments, folder=self.folder)
        self.assertEqual(done.returncode, 0, done.stderr.decode())
        return done

    def refused(self, name, words, *more):
        done = run("solve", name, *more, "--quiet", folder=self.folder)
        message = done.stderr.decode()
        self.assertEqual(done.returncode, 2, message)
        self.assertIn(words, message)
        self.assertIn(str(name), message)
        self.assertLess(len(message), 5000)

    def trajectory_of(self, problem):
        return json.loads(self.dlcs("solve", problem, "--format", "json", "--quiet").stdout)["trajectory"]

    def as_json(self, system, **replaced):
        content = {name: value.tolist() for name, value in system.items()} | replaced
        (self.folder / "system.json").write_text(json.dumps(content))
        return "system.json"

    # Results.

    def solve_to(self, problem, *names):
        """The trajectory as JSON, and files with the same."""
        for name in names:
            self.dlcs("solve", problem, "--output", name, "--quiet")
        self.assertEqual(sorted(p.name for p in self.folder.iterdir() if p.name in names), sorted(names))
        return json.loads(self.dlcs("solve", problem, "--format", "json", "--quiet").stdout)

    def expect_same(self, document, read, lists_are_columns=False):
        trajectory = document["trajectory"]
        times = len(trajectory["times"])
        t = np.asarray(read["t"])
        self.assertEqual(t.shape, (times, 1) if lists_are_columns else (times,))
        self.assertEqual(bits(t), bits(trajectory["times"]))
        for name in "xyw":
            self.assertEqual(np.asarray(read[name]).shape, (times, len(trajectory[name]) // times))
            self.assertEqual(bits(read[name]), bits(trajectory[name]), name)
        switchings = [switching["time"] for switching in document["summary"]["switching_times"]]
        self.assertEqual(bits(read["switching_times"]), bits(switchings))
        limits = trajectory["left_limits"]
        self.assertEqual(bits(read["left_times"]), bits([trajectory["times"][limit["index"]] for limit in limits]))
        for k, limit in enumerate(limits):
            if limit["y"]:
                self.assertEqual(bits(np.asarray(read["left_y"])[k]), bits(limit["y"]))

    def expect_summary(self, document, text):
        summary = json.loads(text)
        self.assertEqual(summary["title"], document["title"])
        for part in ("verdict", "certificate", "switching_times"):
            self.assertEqual(summary["summary"][part], document["summary"][part])

    def test_other_programs_read_results(self):
        for problem in ("named-rectifier.json", "bouncing-ball.json", "example-4.1.json"):
            path = EXAMPLES / problem
            if not path.exists():
                continue
            with self.subTest(problem=problem):
                document = self.solve_to(path, "r.npy", "r.npz", "r.h5", "r.hdf5", "r.mat")
                trajectory = document["trajectory"]
                rows = len(trajectory["times"])
                plain = np.load(self.folder / "r.npy")
                self.assertEqual(bits(plain[:, 0]), bits(trajectory["times"]))
                columns = [np.reshape(trajectory[name], (rows, -1)) for name in "xyw"]
                self.assertEqual(bits(plain[:, 1:]), bits(np.hstack(columns)))
                names = document["analysis"]["state_names"]
                with np.load(self.folder / "r.npz") as arrays:
                    self.expect_same(document, arrays)
                    self.expect_summary(document, arrays["summary.json"])
                    if names:
                        self.assertEqual(arrays["state_names"].tolist(), names)
                for name in ("r.h5", "r.hdf5"):
                    with h5py.File(self.folder / name) as file:
                        self.expect_same(document, {key: file[key][()] for key in file})
                        self.expect_summary(document, file.attrs["summary"])
                        if names:
                            self.assertEqual([one.decode() for one in file["state_names"]], names)
                mat = scipy.io.loadmat(self.folder / "r.mat")
                self.expect_same(document, mat, lists_are_columns=True)
                self.expect_summary(document, str(mat["summary"][0]))
                if names:
                    self.assertEqual([str(cell[0][0]) for cell in mat["state_names"]], names)

    def test_the_ending_chooses_unless_format_does(self):
        problem = self.as_json(SYSTEM)
        for name, begin in (
            ("a.CSV", b"t,x1"),
            ("a.json", b"{"),
            ("a.npy", b"\x93NUMPY"),
            ("a.txt", b"system.json:"),
        ):
            self.dlcs("solve", problem, "--output", name, "--quiet")
            self.assertTrue((self.folder / name).read_bytes().startswith(begin), name)
        self.dlcs("solve", problem, "--output", "b.npy", "--format", "csv", "--quiet")
        self.assertTrue((self.folder / "b.npy").read_bytes().startswith(b"t,x1"))
        self.dlcs("solve", problem, "--output", "b.csv", "--format", "npz", "--quiet")
        self.assertTrue(zipfile.is_zipfile(self.folder / "b.csv"))

    def test_formats_of_arrays_need_a_file(self):
        problem = self.as_json(SYSTEM)
        for format_ in ("npy", "npz", "hdf5", "mat"):
            for more in ((), ("--output", "-")):
                done = run("solve", problem, "--format", format_, *more, folder=self.folder)
                self.assertEqual(done.returncode, 2)
                self.assertIn(f"{format_} is not text; name a file for it with --output", done.stderr.decode())
                self.assertEqual(done.stdout, b"")

    def test_other_commands_take_the_ending_of_a_format_that_they_write(self):
        problem = self.as_json(SYSTEM)
        self.dlcs("analyze", problem, "--output", "a.json")
        self.assertIn("matrix_class", json.loads((self.folder / "a.json").read_text()))
        (self.folder / "members.csv").write_text("1,2\n3,4\n")
        self.dlcs("ensemble", problem, "members.csv", "--output", "e.csv", "--quiet")
        self.assertTrue((self.folder / "e.csv").read_text().startswith("member,label,t"))
        done = run("ensemble", problem, "members.csv", "--output", "e.npz", folder=self.folder)
        self.assertEqual(done.returncode, 2)
        self.assertIn("e.npz would be npz, which this command does not write", done.stderr.decode())

    def test_a_file_is_whole_or_not_there(self):
        problem = self.as_json(SYSTEM)
        for name in ("r.npy", "r.npz", "r.h5", "r.mat"):
            old = self.folder / name
            old.write_text("old")
            limited = run(
                "solve", problem, "--output", name, "--steps", "10000", "--quiet", folder=self.folder,
                restore_signals=False,  # one of which would end the program
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000)),
            )  # fmt: skip
            self.assertEqual(limited.returncode, 3, limited.stderr.decode())
            self.assertIn(name, limited.stderr.decode())
            self.assertEqual(old.read_text(), "old")
            self.assertEqual(list(self.folder.glob(name + ".*")), [])
            missing = run("solve", problem, "--output", "no/such/" + name, folder=self.folder)
            self.assertEqual(missing.returncode, 2)
            self.assertIn("no/such/" + name, missing.stderr.decode())

    # Problems.

    def save(self, kind, system):
        """Writes the system as other programs store it. Returns the name of the file."""
        name = f"system-{kind}.{'npz' if kind.startswith('npz') else 'mat'}"
        path = self.folder / name
        if kind == "npz":
            np.savez(path, **system)
        elif kind == "npz-packed":
            np.savez_compressed(path, **system)
        else:
            lists = "row" if kind == "mat-rows" else "column"
            scipy.io.savemat(path, system, do_compression=kind == "mat-packed", oned_as=lists)
        return name

    KINDS = ("npz", "npz-packed", "mat", "mat-packed", "mat-rows")

    def test_problems_are_those_of_json(self):
        for system in (SYSTEM, INTEGERS):
            expected = self.trajectory_of(self.as_json(system))
            for kind in self.KINDS:
                with self.subTest(kind=kind):
                    self.assertEqual(self.trajectory_of(self.save(kind, system)), expected)

    def test_every_type_and_order_of_numpy_is_read(self):
        expected = self.trajectory_of(self.as_json(INTEGERS))
        for type_ in ("<f8", ">f8", "<f4", ">f4", "<f2", ">f2", "i1", "<i2", ">i2", "<i4", ">i4", "<i8", ">i8"):
            for order in "CF":
                with self.subTest(type=type_, order=order):
                    arrays = {name: np.array(value, dtype=type_, order=order) for name, value in INTEGERS.items()}
                    self.assertEqual(self.trajectory_of(self.save("npz", arrays)), expected)
        for type_ in (np.float32, np.int16, np.int64, np.int8):
            with self.subTest(type=type_):
                arrays = {name: value.astype(type_) for name, value in INTEGERS.items()}
                self.assertEqual(self.trajectory_of(self.save("mat-packed", arrays)), expected)

    def test_big_endian_mat_files_are_read(self):
        def element(type_, data):
            return struct.pack(">II", type_, len(data)) + data + bytes(-len(data) % 8)

        content = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack(">HH", 0x0100, 0x4D49)
        for name, value in SYSTEM.items():
            value = np.atleast_2d(value)
            content += element(
                14,
                element(6, struct.pack(">II", 6, 0))
                + element(5, struct.pack(">ii", *value.shape))
                + element(1, name.encode())
                + element(9, value.astype(">f8").tobytes("F")),
            )
        (self.folder / "big.mat").write_bytes(content)
        self.assertEqual(self.trajectory_of("big.mat"), self.trajectory_of(self.as_json(SYSTEM)))

    def test_sparse_matrices_stay_sparse(self):
        sparse = {**SYSTEM, "A": scipy.sparse.csc_matrix(SYSTEM["A"]), "B": scipy.sparse.csc_matrix(SYSTEM["B"])}
        entries = {"rows": 2, "columns": 2, "entries": [[0, 0, -1.1], [0, 1, 0.3], [1, 1, -2.0]]}
        expected = self.trajectory_of(self.as_json(SYSTEM, A=entries))
        for kind in ("mat", "mat-packed"):
            self.assertEqual(self.trajectory_of(self.save(kind, sparse)), expected)
        # A dense matrix of this size would be refused.
        m = 30_000
        large = {
            "A": scipy.sparse.diags([-1.0 - np.arange(m) / m], [0], format="csc"),
            "B": scipy.sparse.csc_matrix(([1.0], ([0], [0])), (m, 1)),
            "N": scipy.sparse.csc_matrix(([1.0], ([0], [0])), (1, m)),
            "M": [[1.0]], "x0": np.ones(m), "g": [-2.0], "T": 1.0,
        }  # fmt: skip
        name = self.save("mat-packed", large)
        self.dlcs("solve", name, "--steps", "10", "--at", "1", "--output", "r.csv", "--no-estimate-error")

    def test_a_source_that_is_missing_is_zero(self):
        rest = {name: value for name, value in SYSTEM.items() if name != "f"}
        self.assertEqual(self.trajectory_of(self.save("npz", rest)), self.trajectory_of(self.as_json(rest, f=[0, 0])))

    def test_files_of_arrays_stand_in_json(self):
        mat, npz = self.save("mat-packed", SYSTEM), self.save("npz", SYSTEM)
        np.save(self.folder / "N.npy", SYSTEM["N"])
        expected = self.trajectory_of(self.as_json(SYSTEM))
        found = self.trajectory_of(
            self.as_json(
                SYSTEM,
                A={"file": mat, "variable": "A"},
                B={"file": npz, "variable": "B"},
                N={"file": "N.npy"},
                x0={"file": mat, "variable": "x0"},
            )
        )
        self.assertEqual(found, expected)

    def test_references_that_lead_nowhere_are_refused(self):
        mat, npz = self.save("mat", SYSTEM | {"word": "text"}), self.save("npz", SYSTEM)
        np.save(self.folder / "list.npy", SYSTEM["f"])
        for reference, words in (
            ({"file": "none.mat", "variable": "A"}, "none.mat: there is no such file"),
            ({"file": mat, "variable": "a"}, f'{mat}: has no variable "a"; it holds A, B, N'),
            ({"file": npz}, f"{npz}: holds 9 variables (A, B, N, M, E, f, g, x0, T)"),
            ({"file": mat, "variable": "word"}, f"{mat}: word is text; must be an array of numbers"),
            ({"file": "system.json"}, "system.json: is neither an .npy, an .npz nor a .mat file"),
            ({"file": "list.npy"}, "A is an array of 1 dimension; must be a matrix"),
            ({"file": 7}, "A.file is a number (7); must be text"),
            ({"file": mat, "variable": 7}, "A.variable is a number"),
            ({"file": mat, "variables": "A"}, "variables"),
        ):
            with self.subTest(reference=reference):
                self.refused(self.as_json(SYSTEM, A=reference), words)

    def test_problems_that_are_wrong_are_refused(self):
        record = np.zeros(1, dtype=[("a", "f8")])
        for kind, name, value, words in (
            ("npz", "A", None, "A is missing; must be the m x m state matrix"),
            ("npz", "a", np.ones(1), '"a" is not a known key'),
            ("npz", "A", np.array([[{}, 1], [2, 3]], dtype=object), "holds Python objects (pickled)"),
            ("npz", "A", SYSTEM["A"] + 0j, "A holds complex numbers"),
            ("mat", "A", SYSTEM["A"] + 1j, "A holds complex numbers"),
            ("npz", "A", record, "A holds records with fields"),
            ("npz", "A", np.array([["a"]]), "A holds text"),
            ("mat", "A", "text", "A is text"),
            ("mat", "A", np.array([[1, "a"]], dtype=object), "A is a cell array"),
            ("mat-packed", "A", {"field": 1}, "A is a structure"),
            ("npz", "A", SYSTEM["A"].ravel(), "A has 1 dimension; must be the m x m state matrix"),
            ("npz", "A", np.zeros((1, 2, 2)), "A has 3 dimensions"),
            ("mat", "A", np.zeros((2, 2, 2)), "A has 3 dimensions"),
            ("npz", "A", np.zeros((0, 2)), "A is empty (0 x 2)"),
            ("mat", "A", np.zeros((0, 0)), "A is empty (0 x 0)"),
            ("npz", "A", np.array([[1, np.nan], [0, 1]]), "A holds in row 0, column 1 (from 0) nan"),
            ("mat", "A", scipy.sparse.csc_matrix([[1, 0], [np.inf, 1]]), "A holds in row 1, column 0 (from 0) inf"),
            ("npz", "A", np.array([[2**53 + 1]]), "an integer of more than 53 bits"),
            ("npz", "A", np.ones((2, 2), dtype=np.longdouble), "floats of at most 64 bits"),
            ("mat", "x0", SYSTEM["A"], "x0 is a matrix of 2 columns; must be one column or one row"),
            ("mat", "T", SYSTEM["f"], "T is 2 x 1; must be the end time"),
            ("npz", "f", np.ones(3), "f: 3 components"),
            ("mat", "A", np.ones((2, 3)), "A: 2x3; must be square"),
        ):
            with self.subTest(kind=kind, words=words):
                system = {**SYSTEM, name: value}
                self.refused(self.save(kind, {k: v for k, v in system.items() if v is not None}), words)
        np.save(self.folder / "A.npy", SYSTEM["A"])
        self.refused("A.npy", "holds one array; a problem has several")
        (self.folder / "new.mat").write_bytes(b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF\r\n\x1a\n")
        self.refused("new.mat", "is a MAT file of version 7.3; save it with -v7")

    # Malicious files.

    def refused_cheaply(self, name, words):
        """Runs with at most half a gigabyte of memory, a part of which the program itself needs."""
        done = run(
            "solve", name, "--quiet", folder=self.folder, timeout=60,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30)),
        )  # fmt: skip
        self.assertEqual(done.returncode, 2, done.stderr.decode())
        self.assertIn(words, done.stderr.decode())

    def test_bombs_are_refused(self):
        def archive(name, member):
            with zipfile.ZipFile(self.folder / name, "w", zipfile.ZIP_DEFLATED) as file:
                with file.open("A.npy", "w", force_zip64=True) as stream:
                    member(stream)

        header = io.BytesIO()
        np.lib.format.write_array_header_1_0(header, {"descr": "|i1", "fortran_order": False, "shape": (40000, 10000)})

        def zeros(stream):
            stream.write(header.getvalue())
            for _ in range(400):
                stream.write(bytes(1_000_000))

        archive("bomb.npz", zeros)
        self.refused_cheaply("bomb.npz", "unpacks, with what was read before it, to more than 268435456 bytes")
        # Its directory declares a small size.
        content = bytearray((self.folder / "bomb.npz").read_bytes())
        directory = content.rindex(b"PK\1\2")
        struct.pack_into("<I", content, directory + 24, 1000)
        (self.folder / "liar.npz").write_bytes(content)
        self.refused_cheaply("liar.npz", "liar.npz: A ")
        archive("shape.npz", lambda stream: np.lib.format.write_array_header_1_0(
            stream, {"descr": "<f8", "fortran_order": False, "shape": (2**31, 2**31)}))  # fmt: skip
        self.refused_cheaply("shape.npz", "must have at most 33554432")

        def mat(packed):
            header = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<HH", 0x0100, 0x4D49)
            return header + struct.pack("<II", 15, len(packed)) + packed

        head = struct.pack("<IIII", 6, 8, 6, 0) + struct.pack("<IIii", 5, 8, 2**31 - 1, 2**31 - 1)
        head += struct.pack("<II", 1, 1) + b"A".ljust(8, b"\0")
        for size, words in ((400_000_000, "unpacks, with what was read before it"), (100, "ends in the middle")):
            pack = zlib.compressobj()
            packed = pack.compress(struct.pack("<II", 14, size) + head + struct.pack("<II", 9, size))
            for _ in range(size // 1_000_000):
                packed += pack.compress(bytes(1_000_000))
            (self.folder / "bomb.mat").write_bytes(mat(packed + pack.flush()))
            self.refused_cheaply("bomb.mat", words)
        dense = head + struct.pack("<II", 9, 8) + bytes(8)
        body = mat(b"")[:128] + struct.pack("<II", 14, len(dense)) + dense
        (self.folder / "shape.mat").write_bytes(body)
        self.refused_cheaply("shape.mat", "A has 2147483647 x 2147483647 numbers; must have at most 33554432")

    def test_damaged_files_are_read_or_refused(self):
        chance = random.Random(18)
        for kind in ("npz", "npz-packed", "mat", "mat-packed"):
            name = self.save(kind, {**SYSTEM, "A": scipy.sparse.csc_matrix(SYSTEM["A"])} if kind == "mat" else SYSTEM)
            good = (self.folder / name).read_bytes()
            for _ in range(20):
                bad = bytearray(good[: chance.randrange(len(good))] if chance.random() < 0.5 else good)
                for _ in range(3):
                    if bad:
                        bad[chance.randrange(len(bad))] = chance.randrange(256)
                (self.folder / name).write_bytes(bad)
                done = run("solve", name, "--quiet", "--steps", "10", "--no-estimate-error", folder=self.folder)
                self.assertIn(done.returncode, (0, 1, 2), done.stderr.decode())
        for name in ("a.npz", "a.mat"):
            for content in (b"", b"PK\3\4", b"PK\5\6", b"MATLAB 5.0 MAT-file", b"\x93NUMPY"):
                (self.folder / name).write_bytes(content)
                self.refused(name, "dlcs: ")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
