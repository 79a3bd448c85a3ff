#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""dlcs-mpi on 1, 2 and 4 ranks against the engine of one process; worlds that are refused; ranks that die.

    mpi_test.py MPIRUN DLCS DLCS_MPI PROJECT_FOLDER
"""

import json
import math
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import h5py
import numpy as np
import scipy.sparse

MPIRUN, DLCS, DLCS_MPI, PROJECT = (pathlib.Path(word).resolve() for word in sys.argv[1:5])
RANKS = (1, 2, 4)
FOLDER = tempfile.TemporaryDirectory()
# Ranks on one machine need no network. They yield to each other, since there may be more of them than processors.
LAUNCHER = [str(MPIRUN), "--allow-run-as-root", "--oversubscribe", "--bind-to", "none"]
ENVIRONMENT = {
    **os.environ,
    "OMPI_MCA_btl": "self,vader",
    "OMPI_MCA_btl_vader_single_copy_mechanism": "none",
    "OMPI_MCA_mpi_yield_when_idle": "1",
}
for variable in ("DLCS_MPI_RANKS", "DLCS_SERVER", "DLCS_CONTEXT"):
    ENVIRONMENT.pop(variable, None)

ITERATIVE = ["--method", "time-stepping", "--propagator", "iterative-stepping"]
RECTIFIER = str(PROJECT / "deploy/examples/rectifier.json")
TWO_STAGES = ["--propagator", "iterative-stepping"]  # without a method


def path(name):
    return str(pathlib.Path(FOLDER.name) / name)


def run(command, environment=None, **kwargs):
    environment = environment or ENVIRONMENT
    return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=300, check=False, **kwargs)


def model(name, *options):
    """The file of a problem that `dlcs model` makes."""
    file = path(name + ".json")
    if not os.path.exists(file):
        made = run([str(DLCS), "model", *options, "--output", file])
        assert made.returncode == 0, made.stderr
    return file


def wall(cells, horizon="1"):
    """Heat in a cube, m = cells³ or so, with contact at one face."""
    return model(
        f"wall-{cells}-{horizon}",
        *("signorini", "--cells", str(cells), "--dimensions", "3", "--coefficient", "0.02", "--horizon", horizon),
    )


def column(width, height):
    """Heat in a column of width × width × height points, with contact along one of its sides."""
    file = path(f"column-{width}-{height}.json")
    if os.path.exists(file):
        return file
    size = width * width * height
    number = np.arange(size).reshape(height, width, width)
    rows, columns, values = [number.ravel()], [number.ravel()], [np.full(size, -6.0)]
    for axis in range(3):
        first, second = np.delete(number, -1, axis).ravel(), np.delete(number, 0, axis).ravel()
        for a, b in ((first, second), (second, first)):
            rows.append(a), columns.append(b), values.append(np.ones(a.size))
    with open(path(f"column-{width}-{height}.mtx"), "w", encoding="utf-8") as market:
        entries = sorted(zip(np.concatenate(columns), np.concatenate(rows), np.concatenate(values)))
        market.write(f"%%MatrixMarket matrix coordinate real general\n{size} {size} {len(entries)}\n")
        market.writelines(f"{i + 1} {j + 1} {value}\n" for j, i, value in entries)
    side = number[:, :, 0].ravel()
    pairs = side.size
    for name, shape in (("B", (size, pairs)), ("N", (pairs, size)), ("M", (pairs, pairs))):
        with open(path(f"column-{width}-{height}-{name}.mtx"), "w", encoding="utf-8") as market:
            market.write(f"%%MatrixMarket matrix coordinate real general\n{shape[0]} {shape[1]} {pairs}\n")
            for k, state in enumerate(side):
                i, j = {"B": (state, k), "N": (k, state), "M": (k, k)}[name]
                market.write(f"{i + 1} {j + 1} 1\n")
    problem = {key: {"matrix_market": os.path.basename(path(f"column-{width}-{height}-{key}.mtx"))} for key in "BNM"}
    problem["A"] = {"matrix_market": f"column-{width}-{height}.mtx"}
    problem.update(f=["sin(6*t)"] * size, g=["0.1*cos(9*t)"] * pairs, x0=[0] * size, T=1)
    with open(file, "w", encoding="utf-8") as opened:
        json.dump(problem, opened)
    return file


def plate(name, side, matrix=lambda A: A, matrix_form=None, **changes):
    """Heat in a square of side × side points with two pairs and one source for all states."""
    second = scipy.sparse.diags([1, -2, 1], [-1, 0, 1], shape=(side, side)) * 0.02 * (side + 1) ** 2
    one = scipy.sparse.identity(side)
    A = matrix(scipy.sparse.kron(second, one) + scipy.sparse.kron(one, second)).tocsr()
    size, pairs = side * side, 2
    at = [side * (side // 3) + side // 4, side * (side // 2) + side // 2]
    problem = {
        "A": matrix_form(A) if matrix_form else entries_of(A),
        "B": {"rows": size, "columns": pairs, "entries": sorted([state, k, 20.0] for k, state in enumerate(at))},
        "N": {"rows": pairs, "columns": size, "entries": [[k, state, 1.0] for k, state in enumerate(at)]},
        "M": {"rows": pairs, "columns": pairs, "entries": [[k, k, 0.1] for k in range(pairs)]},
        "f": {"matrix": {"rows": size, "columns": 1, "entries": [[i, 0, 1.0] for i in range(size)]},
              "of": ["-4*sin(6*t)"]},
        "g": ["0.1*cos(3*t)"] * pairs,
        "x0": [0.1] * size,
        "T": 1,
        **changes,
    }
    with open(path(name), "w", encoding="utf-8") as file:
        json.dump(problem, file)
    return path(name)


def entries_of(matrix):
    """The form of problem files for a sparse matrix."""
    by_row = matrix.tocsr().tocoo()
    entries = [[int(i), int(j), float(value)] for i, j, value in zip(by_row.row, by_row.col, by_row.data)]
    return {"rows": matrix.shape[0], "columns": matrix.shape[1], "entries": entries}


class Result:
    """The output of a solve, and its exit code."""

    def __init__(self, command, file, environment=None):
        done = run([*command, "--format", "json", "--output", file], environment)
        self.code, self.errors = done.returncode, done.stderr
        if not os.path.exists(file):
            raise AssertionError(f"{command}: {done.returncode} {done.stderr}")
        with open(file, encoding="utf-8") as opened:
            self.document = json.load(opened)
        os.remove(file)
        self.summary = self.document["summary"]
        self.trajectory = {key: np.array(self.document["trajectory"][key]) for key in ("times", "x", "y", "w")}
        self.cost, self.propagator = self.summary["cost"], self.summary["propagator"]


def solve(problem, *options):
    return Result([str(DLCS), "solve", problem, *options], path("one.json"))


def solve_on(ranks, problem, *options, own=()):
    command = [*LAUNCHER, "-n", str(ranks), str(DLCS_MPI), "--ranks", str(ranks), *own, "solve", problem, *options]
    # Two ranks that multiply small matrices together wait for microseconds: they need not yield.
    spins = {**ENVIRONMENT, "OMPI_MCA_mpi_yield_when_idle": "0"} if ranks == 2 and "--ranks-per-group" in own else None
    return Result(command, path("many.json"), spins)


def sparse(form):
    """The sparse matrix of a form of problem files."""
    if "kronecker_sum" in form:
        factors = [sparse(factor) for factor in form["kronecker_sum"]]
        sizes = [factor.shape[0] for factor in factors]
        terms = []
        for k, factor in enumerate(factors):
            slower, faster = (scipy.sparse.identity(math.prod(part)) for part in (sizes[:k], sizes[k + 1:]))
            terms.append(scipy.sparse.kron(scipy.sparse.kron(slower, factor), faster))
        return sum(terms[1:], terms[0]).tocsr()
    places = (form["row_indices"], form["column_indices"])
    return scipy.sparse.csr_matrix((form["values"], places), shape=(form["rows"], form["columns"]))


def write_market(file, matrix, symmetric=False, encoding="utf-8"):
    """The entries in a random order; of a symmetric matrix one triangle. utf-8-sig begins with a byte order mark."""
    entries = scipy.sparse.tril(matrix).tocoo() if symmetric else matrix.tocoo()
    order = np.random.default_rng(1).permutation(entries.nnz)
    with open(path(file), "w", encoding=encoding) as market:
        market.write(f"%%MatrixMarket matrix coordinate real {'symmetric' if symmetric else 'general'}\n% a comment\n")
        market.write(f"{entries.shape[0]} {entries.shape[1]} {entries.nnz}\n")
        for i, j, value in zip(entries.row[order], entries.col[order], entries.data[order]):
            market.write(f"{i + 1} {j + 1} {float(value)!r}\n")
    return {"matrix_market": file}


def write_petsc(file, matrix):
    """As MatView() of PETSc does (https://petsc.org/release/manualpages/Mat/MatLoad)."""
    rows = matrix.tocsr()
    rows.sort_indices()
    with open(path(file), "wb") as binary:
        np.array([1211216, *rows.shape, rows.nnz], ">i4").tofile(binary)
        for values, kind in ((np.diff(rows.indptr), ">i4"), (rows.indices, ">i4"), (rows.data, ">f8")):
            values.astype(kind).tofile(binary)
    return {"file": file}


def problem_file(name, **changes):
    """The file of a wall with other keys."""
    with open(wall(8), encoding="utf-8") as opened:
        problem = {**json.load(opened), **changes}
    with open(path(name), "w", encoding="utf-8") as file:
        json.dump(problem, file)
    return path(name)


class MpiTest(unittest.TestCase):
    def agree(self, one, many, tolerance=1e-10):
        self.assertEqual(one.code, many.code, many.errors)
        self.assertEqual(one.summary["verdict"], many.summary["verdict"])
        sizes = {key: np.abs(one.trajectory[key]).max() for key in ("times", "x", "y", "w")}
        sizes["w"] = max(sizes["w"], sizes["y"])  # w may vanish, as a difference of terms of the size of y
        for key, size in sizes.items():
            a, b = one.trajectory[key], many.trajectory[key]
            self.assertEqual(a.shape, b.shape)
            self.assertLessEqual(np.abs(a - b).max(), tolerance * size, key)
        for key in ("steps", "lcps", "windows", "iterations"):
            self.assertEqual(one.cost[key], many.cost[key], key)

    def certificates_agree(self, one, many):
        a, b = one.summary["certificate"], many.summary["certificate"]
        size = {"ode_defect": "ode_scale", "drift_of_rows": None}
        for key, value in b.items():
            scale = a.get(size.get(key, "lcp_scale") or "", 1)
            self.assertLessEqual(abs(value - a[key]), 1e-9 * max(scale, 1), key)

    def steps_agree(self, problem, *options, ranks=(2, 4)):
        """Iterative steps with the active sets of one process, and Krylov counts that ranks do not change."""
        options = [*options, "--no-estimate-error"]
        one = solve(problem, *options)
        self.assertGreater(np.abs(one.trajectory["y"]).max(), 0)
        iterations = []
        for count in ranks:
            with self.subTest(problem=problem, ranks=count):
                many = solve_on(count, problem, *options)
                self.agree(one, many)
                self.certificates_agree(one, many)
                self.assertEqual(many.propagator["used"], "PROPAGATOR_KIND_ITERATIVE_STEPPING")
                if count > 1:  # of each rank
                    self.assertLess(int(many.cost["predicted_bytes"]), int(one.cost["predicted_bytes"]))
                active = [(result.trajectory["y"] > 0) for result in (one, many)]
                self.assertTrue((active[0] == active[1]).all())
                iterations.append(int(many.propagator["linear_iterations"]))
                # Active sets are checked before the equations are solved completely, so their number may differ by one.
                changes = [int(result.propagator["set_changes"]) for result in (one, many)]
                self.assertLessEqual(abs(changes[0] - changes[1]), 1)
        self.assertLessEqual(max(iterations), 1.2 * min(iterations))
        return one

    # Many pairs.

    def test_implicit_euler_on_a_wall(self):
        self.steps_agree(wall(8), *ITERATIVE, "--steps", "10", "--at", "0:0.25:1", ranks=RANKS)

    def test_an_obstacle_bounds_states(self):
        # M = 0: the active set is one of states.
        membrane = model(
            "membrane",
            *("obstacle", "--cells", "24", "--dimensions", "2", "--coefficient", "0.1", "--load", "-4*sin(6*t)"),
        )
        self.steps_agree(membrane, *ITERATIVE, "--steps", "10", "--at", "0:0.25:1")

    def test_two_stages_and_a_mass_matrix(self):
        with open(wall(8), encoding="utf-8") as opened:
            problem = json.load(opened)
        size = len(problem["x0"])
        entries = [[k, k, 1 + 0.5 * (k % 2)] for k in range(size)]
        entries += [[k, k + 1, 0.1] for k in range(size - 1)] + [[k + 1, k, 0.1] for k in range(size - 1)]
        problem["E"] = {"rows": size, "columns": size, "entries": sorted(entries)}
        file = path("mass.json")
        with open(file, "w", encoding="utf-8") as opened:
            json.dump(problem, opened)
        one = self.steps_agree(file, *TWO_STAGES, "--steps", "10", "--at", "0.5,1")
        self.assertEqual(int(one.cost["lcps"]), 21)

    def test_systems_that_are_not_symmetric(self):
        # With convection and a mixed derivative, by GMRES.
        put = model("put", "american-option", "--cells", "16", "--dimensions", "2", "--correlation", "0.5")
        self.steps_agree(put, *ITERATIVE, "--steps", "10", "--at", "0.5,1")

    def test_smooth_intervals_start_alike(self):
        # g jumps, so y does, and the left limits are kept.
        with open(wall(8), encoding="utf-8") as opened:
            problem = json.load(opened)
        problem["g"] = problem["N"]["rows"] * ["0.1 - 0.5*(t >= 0.3)"]
        file = path("jump.json")
        with open(file, "w", encoding="utf-8") as opened:
            json.dump(problem, opened)
        one = self.steps_agree(file, *ITERATIVE, "--steps", "10", "--at", "0,0.3,1", ranks=(2,))
        self.assertTrue(one.document["trajectory"]["left_limits"])

    def test_the_error_is_controlled_alike(self):
        options = [*ITERATIVE, "--tolerance", "1e-2", "--at", "0,1"]
        one, two = solve(wall(8), *options), solve_on(2, wall(8), *options)
        self.agree(one, two, tolerance=1e-9)
        # Residuals of the steps are in sum a hundredth of the tolerance, and the preconditioners are two.
        left = 0.01 * one.summary["accuracy"]["tolerance"]
        self.assertLess(abs(one.summary["accuracy"]["error"] - two.summary["accuracy"]["error"]), left)

    # Files that ranks read and write by rows.

    def test_ranks_read_their_rows(self):
        options = [*ITERATIVE, "--steps", "10", "--at", "0.5,1", "--no-estimate-error"]
        with open(wall(8), encoding="utf-8") as opened:
            problem = json.load(opened)
        A, B, N = (sparse(problem[key]) for key in "ABN")
        one = solve(wall(8), *options)
        forms = (
            {"A": write_market("a.mtx", A), "B": write_market("b.mtx", B), "N": write_market("n.mtx", N)},
            {"A": write_market("marked.mtx", A, encoding="utf-8-sig")},
            {"A": write_market("half.mtx", A, symmetric=True), "B": write_petsc("b.petsc", B)},
            {"A": write_petsc("a.petsc", A), "N": write_petsc("n.petsc", N)},
        )
        self.assertEqual(abs(A - A.T).max(), 0)
        inline = solve_on(2, wall(8), *options)
        for form in forms:
            with self.subTest(form=form):
                by_rows = solve_on(2, problem_file("by-rows.json", **form), *options)
                self.agree(one, by_rows)
                for key in ("x", "y", "w"):  # entries are the same, and so are all bits
                    self.assertTrue((by_rows.trajectory[key] == inline.trajectory[key]).all(), key)

    def test_pairs_go_with_their_states_in_any_order(self):
        # The rank that has a row of N is not the one that reads it.
        with open(wall(8), encoding="utf-8") as opened:
            problem = json.load(opened)
        B, N, M = (sparse(problem[key]) for key in "BNM")
        pairs = N.shape[0]
        order = np.random.default_rng(2).permutation(pairs)
        rows = M.tocsr()[order][:, order].tocoo()
        swapped = {
            "B": write_petsc("b-swapped.petsc", B.tocsr()[:, order]),
            "N": write_market("n-swapped.mtx", N.tocsr()[order]),
            "M": {"rows": pairs, "columns": pairs,
                  "entries": [[int(i), int(j), float(v)] for i, j, v in zip(rows.row, rows.col, rows.data)]},
            "g": {"matrix": {"rows": pairs, "columns": pairs,
                             "entries": [[int(k), int(k), 1.0] for k in range(pairs)]}, "of": ["0.1 - 0.5*t"] * pairs},
        }
        options = [*ITERATIVE, "--steps", "10", "--at", "0.5,1", "--no-estimate-error"]
        file = problem_file("swapped.json", **swapped)
        self.agree(solve(file, *options), solve_on(3, file, *options))

    def test_ranks_write_their_rows(self):
        # g jumps, so there are left limits too.
        pairs = 49
        file = problem_file("jump.json", g=pairs * ["0.1 - 0.5*(t >= 0.3)"])
        options = [*ITERATIVE, "--steps", "10", "--at", "0,0.3,1", "--no-estimate-error"]
        for name in ("whole.npz", "rows.h5"):
            done = run([*LAUNCHER, "-n", "2", str(DLCS_MPI), "solve", file, *options, "--output", path(name)])
            self.assertEqual(done.returncode, 0, done.stderr)
        whole = np.load(path("whole.npz"))  # which the first rank writes
        with h5py.File(path("rows.h5")) as opened:
            rows = {key: opened[key][()] for key in opened}
            self.assertEqual(json.loads(opened.attrs["summary"])["summary"]["times"], 3)
        self.assertLessEqual({"t", "x", "y", "w", "left_times", "left_y", "left_w"}, set(rows))
        for key, values in rows.items():
            self.assertEqual(values.shape, whole[key].shape, key)
            self.assertTrue((values == whole[key]).all(), key)
        self.assertEqual(rows["left_times"].size, 1)
        self.assertGreater(np.abs(rows["y"]).max(), 0)

    def test_a_full_disk_is_an_error_of_all_formats(self):
        # There is room for what frames the rows of an HDF5 file, and not for the rows.
        folder = path("full")
        os.makedirs(folder)
        full = f'mount -t tmpfs -o size=64k none {folder} || exit 99; "$@"; code=$?; ls -A {folder}; exit $code'
        in_it = ["unshare", "--mount", "sh", "-c", full, "sh"]
        if run([*in_it, "true"]).returncode != 0:
            self.skipTest("there are no namespaces of mounts")
        options = [*ITERATIVE, "--steps", "40", "--at", "0:0.025:1", "--no-estimate-error"]
        for name in ("rows.h5", "whole.npz"):
            with self.subTest(name=name):
                output = os.path.join(folder, name)
                ranks = [*LAUNCHER, "-n", "2", str(DLCS_MPI), "solve", wall(8), *options, "--output", output]
                done = run([*in_it, *ranks])
                self.assertEqual(done.returncode, 3, done.stderr)
                self.assertIn(f"cannot write {output}", done.stderr)
                self.assertEqual(done.stdout, "")  # no file is left

    def test_errors_in_files_are_those_of_all_ranks(self):
        size = 7 * 7 * 8  # of states
        head = f"%%MatrixMarket matrix coordinate real general\n{size} {size} "
        diagonal = "".join(f"{k} {k} -1\n" for k in range(1, size + 1))
        entries = 4 * size * b"\0"
        cases = (
            ("no-number.mtx", f"{head}{size}\n{diagonal}".replace("390 390 -1", "390 390 x"), "line 392: \"x\" where"),
            ("twice.mtx", f"{head}{size + 1}\n{diagonal}7 7 1\n", "row 7, column 7 twice"),
            ("few.mtx", f"{head}{size + 2}\n{diagonal}", f"{size + 2} entries are announced, and {size} follow"),
            ("outside.mtx", f"{head}1\n{size + 1} 1 1\n", f"line 3: {size + 1}, the row of an entry; must be from 1"),
            ("short.petsc", np.array([1211216, size, size, 1], ">i4").tobytes() + entries, "bytes; must have"),
            ("damaged.petsc", np.array([1211216, size, size, 0], ">i4").tobytes() + b"\1" + entries[1:], "is damaged"),
        )
        for name, content, rule in cases:
            with self.subTest(name=name):
                with open(path(name), "wb") as file:
                    file.write(content if isinstance(content, bytes) else content.encode())
                form = {"file": name} if name.endswith("petsc") else {"matrix_market": name}
                both = [*LAUNCHER, "-n", "2", str(DLCS_MPI), "solve", problem_file("bad.json", A=form), *ITERATIVE]
                self.refused(both, name, rule)

    # Few pairs.

    def contour_agrees(self, problem, *options):
        options = ["--propagator", "contour", "--no-estimate-error", *options]
        one = solve(problem, *options)
        self.assertGreater(np.abs(one.trajectory["y"]).max(), 0)
        for ranks in RANKS:
            with self.subTest(problem=problem, ranks=ranks):
                many = solve_on(ranks, problem, *options)
                self.assertEqual(many.propagator["used"], "PROPAGATOR_KIND_CONTOUR")
                self.agree(one, many)
                self.assertEqual(one.propagator["terms"], many.propagator["terms"])
                # Each node is factored by one rank.
                self.assertEqual(one.propagator["factorizations"], many.propagator["factorizations"])
                # The blocks that travel are those of one process.
                self.assertTrue((one.trajectory["y"] == many.trajectory["y"]).all())
        return one

    def test_windows_with_the_nodes_of_a_contour_shared(self):
        one = self.contour_agrees(wall(8), "--method", "laplace-iteration", "--steps", "40", "--at", "0:0.25:1")
        self.assertGreater(one.cost["iterations"], 0)

    def test_steps_with_the_nodes_of_a_contour_shared(self):
        self.contour_agrees(wall(8), "--method", "exponential-integrator", "--steps", "40", "--at", "0:0.25:1")

    # Few pairs, by groups of ranks that share rows.

    CONTOUR = ["--propagator", "contour", "--no-estimate-error"]
    WINDOWS = [*CONTOUR, "--method", "laplace-iteration", "--steps", "20"]
    FEW_NODES = [*CONTOUR, "--method", "laplace-iteration", "--steps", "4", "--at", "0.5"]

    def groups_agree(self, problem, options, worlds=((2, 2),)):
        """Returns the results of each (ranks, ranks per group)."""
        one = solve(problem, *options)
        self.assertGreater(np.abs(one.trajectory["y"]).max(), 0)
        results = []
        for ranks, of_group in worlds:
            with self.subTest(problem=problem, ranks=ranks, ranks_per_group=of_group):
                many = solve_on(ranks, problem, *options, own=["--ranks-per-group", str(of_group)])
                self.agree(one, many)
                self.certificates_agree(one, many)
                self.assertEqual(many.propagator["used"], "PROPAGATOR_KIND_CONTOUR")
                self.assertEqual(one.propagator["terms"], many.propagator["terms"])
                # No rank factors.
                self.assertEqual(int(many.propagator["factorizations"]), 0)
                self.assertGreater(int(many.propagator["linear_iterations"]), 0)
                results.append(many)
        return results

    def test_groups_of_ranks_agree_with_one_process(self):
        small = plate("small-plate.json", 4)  # four ranks on two processors take a while for each message
        two, four = self.groups_agree(small, self.FEW_NODES, worlds=((2, 2), (4, 2)))
        # The blocks of a node depend on the ranks of its group alone.
        self.assertTrue((two.trajectory["y"] == four.trajectory["y"]).all())
        self.assertEqual(two.propagator["linear_iterations"], four.propagator["linear_iterations"])
        again = solve_on(2, small, *self.FEW_NODES, own=["--ranks-per-group", "2"])
        for key in ("x", "y", "w"):
            self.assertTrue((two.trajectory[key] == again.trajectory[key]).all(), key)

    def test_groups_of_ranks_with_convection(self):
        def with_wind(A):
            side = math.isqrt(A.shape[0])
            first = scipy.sparse.diags([-1, 1], [-1, 1], shape=(side, side)) * 0.1 * (side + 1)
            return A + scipy.sparse.kron(scipy.sparse.identity(side), first)

        options = [*self.CONTOUR, "--method", "exponential-integrator", "--steps", "20", "--at", "0.5"]
        self.groups_agree(plate("wind.json", 12, with_wind), options)

    def test_groups_of_ranks_with_a_mass_matrix(self):
        side = 18  # smaller ones are multiplied by its inverse
        weights = scipy.sparse.diags([1, 4, 1], [-1, 0, 1], shape=(side, side)) / 6
        E = entries_of(scipy.sparse.kron(weights, scipy.sparse.identity(side)))
        # More output times than columns.
        self.groups_agree(plate("mass-plate.json", side, E=E), [*self.WINDOWS, "--at", "0.1:0.1:1"])

    def test_groups_read_their_rows(self):
        by_rows = plate("by-rows-plate.json", 12, matrix_form=lambda A: write_petsc("plate.petsc", A))
        options = [*self.WINDOWS, "--at", "0.5"]
        whole, rows = (
            solve_on(2, file, *options, own=["--ranks-per-group", "2"]) for file in (plate("plate.json", 12), by_rows)
        )
        for key in ("x", "y", "w"):
            self.assertTrue((whole.trajectory[key] == rows.trajectory[key]).all(), key)

    def test_groups_that_cannot_be_are_refused(self):
        words = ["solve", plate("plate.json", 12), *self.WINDOWS]
        groups = ["--ranks-per-group"]
        two, three = ([*LAUNCHER, "-n", str(ranks), str(DLCS_MPI)] for ranks in (2, 3))
        self.refused([*three, *groups, "2", *words], "--ranks-per-group 2: must divide the number of ranks, which is 3")
        self.refused([*two, *groups, "two", *words], "--ranks-per-group two: not a number of ranks from 1 on")
        self.refused([*two, *groups, "2", "solve", wall(8), *ITERATIVE], "--ranks-per-group 2:", "--propagator contour")
        members = str(PROJECT / "deploy/examples/rectifier-members.json")
        self.refused([*two, *groups, "2", "ensemble", RECTIFIER, members], "--ranks-per-group 2:", "one rank")
        each = ["-n", "1", str(DLCS_MPI), *groups]
        self.refused([*LAUNCHER, *each, "1", *words, ":", *each, "2", *words], "not the same in all ranks")

    def test_sectors_that_are_not_proven_by_rows_are_refused(self):
        # A mixed derivative: entries off the diagonal have both signs, and are larger together than those on it.
        def twisted(A):
            side = math.isqrt(A.shape[0])
            mixed = scipy.sparse.diags([-1, 1], [-1, 1], shape=(side, side)) * 0.1 * (side + 1)
            return A + 0.8 * scipy.sparse.kron(mixed, mixed)

        words = ["solve", plate("twisted.json", 12, twisted), *self.WINDOWS, "--at", "0.5"]
        self.assertEqual(run([str(DLCS), *words]).returncode, 0)
        done = run([*LAUNCHER, "-n", "2", str(DLCS_MPI), "--ranks-per-group", "2", *words])
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("without a factorization", " ".join(done.stdout.split()))

    # Promises of the README.

    def test_the_same_bits_on_the_same_number_of_ranks(self):
        for options in (ITERATIVE, ["--method", "laplace-iteration", "--propagator", "contour"]):
            options = [*options, "--steps", "20", "--at", "0:0.25:1", "--no-estimate-error"]
            first, second = (solve_on(2, wall(8), *options) for _ in range(2))
            for key in ("x", "y", "w"):
                self.assertTrue((first.trajectory[key] == second.trajectory[key]).all(), key)

    def test_what_a_rank_sends_in_a_step_does_not_grow_with_the_ranks(self):
        # A column of heat for each rank, all of the same size, stacked.
        most = {}
        for ranks in (2, 4, 8):
            options = [*ITERATIVE, "--steps", "5", "--at", "1", "--no-estimate-error"]
            many = solve_on(ranks, column(8, 8 * ranks), *options, own=["--volume"])
            of_ranks = re.findall(r"sent \d+ messages with (\d+) bytes", many.errors)
            self.assertEqual(len(of_ranks), ranks, many.errors)
            most[ranks] = max(map(int, of_ranks)) / int(many.propagator["linear_iterations"])
        # A rank in the middle has two neighbors, at the end one; coarse levels add what they add.
        self.assertLess(most[8], 1.25 * most[4])
        self.assertLess(most[4], 2.5 * most[2])

    # Ensembles.

    def ensemble_as_alone(self, words, code):
        options = ["--format", "csv", "--threads", "1"]
        alone = run([str(DLCS), "ensemble", *words, *options])
        self.assertEqual(alone.returncode, code, alone.stderr)
        for ranks in RANKS:
            with self.subTest(words=words, ranks=ranks):
                file = path(f"ensemble-{ranks}.csv")
                one = [*LAUNCHER, "-n", str(ranks), str(DLCS_MPI), "--ranks", str(ranks), "ensemble"]
                done = run([*one, *words, *options, "--output", file])
                self.assertEqual(done.returncode, code, done.stderr)
                self.assertIn(alone.stderr.splitlines()[-1], done.stderr)
                self.assertEqual(pathlib.Path(file).read_text(encoding="utf-8"), alone.stdout)
                os.remove(file)

    def test_members_of_an_ensemble_are_shared(self):
        # More than one round, and a member whose states overflow.
        members = [{"label": f"{k} V", "g": [f"-{k}*sin(2*pi*t)"]} for k in range(1, 300)]
        members.insert(77, {"label": "none", "f": ["1e308"]})
        with open(path("members.json"), "w", encoding="utf-8") as opened:
            json.dump({"members": members}, opened)
        self.ensemble_as_alone([RECTIFIER, path("members.json"), "--steps", "50"], 1)

    def test_sweeps_of_decks_are_shared(self):
        with open(path("sweep.cir"), "w", encoding="utf-8") as opened:
            opened.write(
                "A rectifier\n.param r=1\nV1 a 0 SIN(0 5 50)\nR1 a b {r}\nD1 b c DM\nC1 c 0 100u\nR2 c 0 100\n"
                ".model DM D(RON=0.1 VFWD=0.6)\n.step param r list 1 2 5\n.tran 1m 20m\n.ic v(c)=0\n.end\n"
            )
        self.ensemble_as_alone([path("sweep.cir")], 0)

    def test_ensembles_that_ranks_cannot_solve_are_refused(self):
        two = [*LAUNCHER, "-n", "2", str(DLCS_MPI), "ensemble"]
        members = str(PROJECT / "deploy/examples/rectifier-members.json")
        self.refused([*two, RECTIFIER, members, "--detach"], "--detach:")
        self.refused([*two, RECTIFIER, "-"], "standard input")
        self.refused([*two, RECTIFIER, members, "--deadline", "5"], "--deadline", "mpirun --timeout")
        with open(path("bad-members.json"), "w", encoding="utf-8") as opened:
            json.dump({"members": [{}, {}, {"x0": [1, 2, 3]}]}, opened)
        self.refused([*two, RECTIFIER, path("bad-members.json")], "members[2].x0")
        with open(path("other-members.json"), "w", encoding="utf-8") as opened:
            json.dump({"members": [{}, {"x0": [1]}]}, opened)
        each = ["-n", "1", str(DLCS_MPI), "ensemble", RECTIFIER]
        both = [*LAUNCHER, *each, members, ":", *each, path("other-members.json")]
        self.refused(both, "different members", code=3)

    # Worlds.

    def refused(self, command, *words, code=2):
        done = run(command)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)

    def test_worlds_of_another_size_are_refused(self):
        solve_it = [str(DLCS_MPI), "solve", wall(8), "--steps", "4"]
        self.refused([*LAUNCHER, "-n", "2", str(DLCS_MPI), "--ranks", "3", *solve_it[1:]], "2 ranks", "3 were promised")
        self.refused(["env", "DLCS_MPI_RANKS=4", *LAUNCHER, "-n", "2", *solve_it], "2 ranks", "4 were promised")
        # A launcher of another MPI starts worlds of one rank.
        self.refused(["env", "SLURM_STEP_NUM_TASKS=8", *solve_it], "1 rank", "SLURM_STEP_NUM_TASKS = 8", "--mpi=pmix")
        done = run(["env", "SLURM_STEP_NUM_TASKS=8", *LAUNCHER, "-n", "2", *solve_it, "--no-estimate-error"])
        self.assertEqual(done.returncode, 0, done.stderr)  # mpirun in a step of srun
        self.refused(["env", "PMI_SIZE=2", *solve_it], "1 rank", "PMI_SIZE = 2")

    def test_bad_arguments_are_refused(self):
        two = [*LAUNCHER, "-n", "2", str(DLCS_MPI)]
        self.refused([*two, "--ranks", "two", "solve", wall(8)], "--ranks two")
        self.refused([*two, "--rank", "2", "solve", wall(8)], "--rank:")
        self.refused([*two, "--ranks"], "--ranks: give the number")
        self.refused([*two, "analyze", wall(8)], "analyze: no command")
        self.refused([*two, "solve", "-"], "standard input")
        self.refused([*two, "solve", wall(8), "--server", "localhost:1"], "--server")
        self.refused([*two, "solve", wall(8), "--deadline", "5"], "--deadline", "mpirun --timeout")
        self.refused([*two, "solve", path("none.json")], "none.json")

    def each_its_own(self, first, second):
        """Two ranks with the words of a solve each."""
        each = [str(DLCS_MPI), "solve"]
        return [*LAUNCHER, "-n", "1", *each, *first, ":", "-n", "1", *each, *second]

    def test_ranks_with_other_problems_are_refused(self):
        with open(wall(8), encoding="utf-8") as opened:
            problem = json.load(opened)
        states, pairs = len(problem["x0"]), problem["N"]["rows"]
        A = sparse(problem["A"]).tocoo()
        faster = [[int(i), int(j), 1.5 * float(v)] for i, j, v in zip(A.row, A.col, A.data)]
        others = (
            (wall(8, "2"), "x0 or T"),
            (wall(12), "A"),
            (problem_file("other-a.json", A={"rows": states, "columns": states, "entries": faster}), "A"),
            (problem_file("other-f.json", f=states * ["sin(9*t)"]), "f"),
            (problem_file("other-g.json", g=pairs * ["0.1 - 0.2*t"]), "g"),
            (problem_file("other-rule.json", rule="least-norm"), "something else"),
        )
        shared = ([*ITERATIVE, "--steps", "4"], ["--method", "laplace-iteration", "--propagator", "contour"])
        for options in shared:
            for other, part in others:
                with self.subTest(other=other, options=options):
                    both = self.each_its_own([wall(8), *options], [other, *options])
                    self.refused(both, f"different problems: {part} is not the same", code=3)

    def test_ranks_with_other_options_are_refused(self):
        one = [wall(8), *ITERATIVE, "--steps", "4", "--at", "1"]
        others = (
            [wall(8), *ITERATIVE, "--steps", "8", "--at", "1"],
            [wall(8), *ITERATIVE, "--steps", "4", "--at", "0.5,1"],
            [*one, "--iteration-tolerance", "1e-3"],
            [*one, "--format", "csv"],
            [wall(8), "--method", "laplace-iteration", "--propagator", "contour", "--steps", "4", "--at", "1"],
        )
        for other in others:
            with self.subTest(other=other):
                self.refused(self.each_its_own(one, other), "different options")
        one.append("--no-estimate-error")
        done = run(self.each_its_own(one, [*one, "--threads", "2"]))
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_rank_that_cannot_read_ends_the_others(self):
        each, options = [str(DLCS_MPI), "solve"], [*ITERATIVE, "--steps", "4"]
        both = [*LAUNCHER, "-n", "1", *each, wall(8), *options, ":", "-n", "1", *each, path("none.json"), *options]
        self.refused(both, "rank 1 failed where others did not", "none.json")

    def test_work_that_is_not_shared_is_named(self):
        done = run([*LAUNCHER, "-n", "2", str(DLCS_MPI), "solve", RECTIFIER])
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("every rank did the same work", done.stderr)
        self.assertEqual(done.stdout.count("Certificate"), 1)
        self.assertNotIn("\x1b", done.stdout)

    def test_a_rank_that_dies_ends_the_solve(self):
        output = path("never.json")
        command = [*LAUNCHER, "-n", "2", str(DLCS_MPI), "solve", wall(12), *ITERATIVE, "--steps", "100000", "--at", "1"]
        with subprocess.Popen([*command, "--output", output], stderr=subprocess.PIPE, text=True, env=ENVIRONMENT,
                              start_new_session=True) as launcher:
            ranks = []
            until = time.monotonic() + 60
            while len(ranks) < 2 and time.monotonic() < until:
                time.sleep(0.2)
                ranks = children_of(launcher.pid)
            self.assertEqual(len(ranks), 2)
            time.sleep(2)  # into the steps
            os.kill(ranks[-1], signal.SIGKILL)
            _, errors = launcher.communicate(timeout=60)
        self.assertNotEqual(launcher.returncode, 0)
        self.assertIn("signal 9", errors)
        self.assertFalse(os.path.exists(output))


def children_of(process):
    """The processes of dlcs-mpi that a launcher started."""
    found = []
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            parent = int((folder / "stat").read_text().rsplit(")", 1)[1].split()[1])
            name = (folder / "comm").read_text().strip()
        except (OSError, ValueError):
            continue
        if parent == process and name == "dlcs-mpi":
            found.append(int(folder.name))
    return sorted(found)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
