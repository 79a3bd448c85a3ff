#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Implicit Euler with equal steps for large sparse systems: PETSc beside `dlcs solve --method time-stepping`.

Usage: petsc_bench.py DLCS [CASE...]

Needs python3-petsc4py, numpy and scipy of Debian, which nothing else here needs. PETSc's TS beuler with SNES
vinewtonrsls takes the same steps: the largest difference of y at T is printed. Each of its linear solvers runs in a
process of its own, with one thread and a limit of time; wall time is that of the steps, without reading and writing.
The report is a table in Markdown; "ratio" is the time of its quickest solver over ours.
"""

import glob
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
import scipy.sparse as sp

STEPS = 100
LIMIT_S = 240
SOLVERS = {
    "GMRES, ILU": "-ksp_type gmres -pc_type ilu",
    "LU": "-ksp_type preonly -pc_type lu",
    "GMRES, hypre": "-ksp_type gmres -pc_type hypre",
}


def line(cells, diffusion=1.0, speed=0.0):
    """D u'' - v u' at the inner points of the unit interval."""
    below, above = diffusion * cells**2 + speed * cells / 2, diffusion * cells**2 - speed * cells / 2
    inner = cells - 1
    return sp.diags(
        [np.full(inner - 1, below), np.full(inner, -2 * diffusion * cells**2), np.full(inner - 1, above)], [-1, 0, 1]
    )


def plus(one, other):
    return sp.kron(one, sp.identity(other.shape[0])) + sp.kron(sp.identity(one.shape[0]), other)


def wall(dimensions, cells, coefficient=0.1):
    """The membrane of Wu & Chen, or its cube: the last layer in one direction is next to a wall with a one-sided
    contact, u = sin(2πt) / 2 on the opposite side."""
    one = line(cells, coefficient)
    A = one
    for _ in range(dimensions - 1):
        A = plus(A, one)
    inner = cells - 1
    layer = inner ** (dimensions - 1)
    states = inner**dimensions
    weight = coefficient * cells**2
    rows = np.arange(states - layer, states)
    B = sp.coo_matrix((np.full(layer, weight), (rows, np.arange(layer))), (states, layer))
    N = sp.coo_matrix((-np.ones(layer), (np.arange(layer), rows)), (layer, states))
    heated = np.zeros((states, 1))
    heated[:layer] = weight
    return {"A": A, "B": B, "N": N, "M": sp.identity(layer), "f": heated, "g": np.zeros((layer, 1)),
            "x0": np.zeros(states)}  # fmt: skip


def flow(cells, pairs):
    """Heat that a flow carries over a square; heaters keep points from falling below a level."""
    one = line(cells, 0.05, 8.0)
    A = plus(one, one)
    states = A.shape[0]
    rows = (2 * np.arange(pairs) + 1) * states // (2 * pairs)
    B = sp.coo_matrix((np.full(pairs, 4.0), (rows, np.arange(pairs))), (states, pairs))
    N = sp.coo_matrix((np.ones(pairs), (np.arange(pairs), rows)), (pairs, states))
    return {"A": A, "B": B, "N": N, "M": 4 * sp.identity(pairs), "f": np.ones((states, 1)), "g": np.ones((pairs, 1)),
            "x0": np.zeros(states)}  # fmt: skip


CASES = {
    "wall 15³": lambda: wall(3, 16),
    "wall 24³": lambda: wall(3, 25),
    "wall 40³": lambda: wall(3, 41),
    "membrane 1/256": lambda: wall(2, 256),
    "flow 150²": lambda: flow(151, 50),
}
FORMULA = "sin(2*pi*t)/2"
HORIZON = 1.0


def as_json(matrix):
    matrix = sp.coo_matrix(matrix)
    return {"rows": matrix.shape[0], "columns": matrix.shape[1], "row_indices": matrix.row.tolist(),
            "column_indices": matrix.col.tolist(), "values": matrix.data.tolist()}  # fmt: skip


def write(case, path):
    content = {name: as_json(case[name]) for name in "ABNM"}
    for name in "fg":
        content[name] = {"matrix": as_json(case[name]), "of": [FORMULA]}
    path.write_text(json.dumps(content | {"x0": case["x0"].tolist(), "T": HORIZON}))


def solve_with_petsc(name, options):
    """Prints seconds, Newton and Krylov iterations, memory and y at T as JSON."""
    sys.path += glob.glob("/usr/lib/petscdir/petsc*/*-real/lib/python3/dist-packages")
    import petsc4py

    petsc4py.init(options)
    from petsc4py import PETSc

    case = CASES[name]()
    m, n = case["A"].shape[0], case["M"].shape[0]
    pad = sp.diags([np.zeros(m + n)], [0])  # the diagonal is stored
    blocks = sp.bmat([[-case["A"], -case["B"]], [case["N"], case["M"]]], format="csr")
    stored = (abs(blocks) + sp.identity(m + n)).tocsr()
    blocks = blocks + pad
    stored.data[:] = 0
    K = (stored + blocks).tocsr()
    K.sort_indices()
    A = PETSc.Mat().createAIJ(K.shape, csr=(K.indptr.astype("i4"), K.indices.astype("i4"), K.data))
    J = A.duplicate(copy=True)
    f, g = case["f"][:, 0], case["g"][:, 0]
    mass = A.createVecLeft()
    mass.getArray()[:m] = 1.0

    def source(t):
        return np.sin(2 * np.pi * t) / 2

    def residual(ts, t, u, rate, F):
        A.mult(u, F)
        out = F.getArray()
        out[:m] += rate.getArray(readonly=True)[:m] - f * source(t)
        out[m:] += g * source(t)

    def jacobian(ts, t, u, rate, shift, matrix, preconditioner):
        A.copy(preconditioner)
        diagonal = preconditioner.getDiagonal()
        diagonal.axpy(shift, mass)
        preconditioner.setDiagonal(diagonal)
        preconditioner.assemble()
        return True

    ts = PETSc.TS().create()
    ts.setType("beuler")
    ts.setIFunction(residual, A.createVecLeft())
    ts.setIJacobian(jacobian, J)
    ts.setTimeStep(HORIZON / STEPS)
    ts.setMaxSteps(STEPS)
    ts.setMaxTime(2 * HORIZON)
    newton = ts.getSNES()
    newton.setType("vinewtonrsls")
    low, high = A.createVecLeft(), A.createVecLeft()
    low.set(-1e20)
    low.getArray()[m:] = 0
    high.set(1e20)
    newton.setVariableBounds(low, high)
    newton.setTolerances(rtol=1e-9, atol=1e-10)
    ts.setFromOptions()  # -ts_adapt_type none is among them
    u = A.createVecLeft()
    u.getArray()[:m] = case["x0"]
    begin = time.perf_counter()
    ts.solve(u)
    seconds = time.perf_counter() - begin
    good = ts.getStepNumber() == STEPS and ts.getConvergedReason() > 0
    peak = next(int(l.split()[1]) for l in open("/proc/self/status") if l.startswith("VmHWM"))
    result = {"seconds": seconds, "good": good, "newton": ts.getSNESIterations(), "krylov": ts.getKSPIterations()}
    print(json.dumps(result | {"peak_mb": peak / 1024, "y": u.getArray()[m:].tolist()}))


def by_petsc(name, options):
    command = [sys.executable, __file__, "--petsc", name, "-ts_adapt_type", "none", *options.split()]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
        result = json.loads(done.stdout)
        return result if result["good"] else None
    except (subprocess.TimeoutExpired, json.JSONDecodeError):
        return None


def by_dlcs(dlcs, path, *options):
    # A process keeps the peak of the one that forked it, which a shell between them makes a small one.
    by_shell = ["sh", "-c", '"$@"; exit $?', "sh"]
    command = [dlcs, "solve", str(path), "--steps", str(STEPS), "--at", str(HORIZON), "--threads", "1", "--quiet",
               "--no-estimate-error", "--format", "json", *options]  # fmt: skip
    result = json.loads(subprocess.run(by_shell + command, capture_output=True, text=True, check=False).stdout)
    cost = result["summary"]["cost"]
    return {"seconds": cost["seconds_total"], "peak_mb": int(cost["process_peak_bytes"]) / 1e6,
            "used": result["summary"]["propagator"]["used"], "y": result["trajectory"]["y"]}  # fmt: skip


def main(dlcs, wanted):
    print("| case | states, pairs | PETSc: seconds (Newton, Krylov iterations; MB) | dlcs, the same steps | ratio "
          "| y apart | dlcs, second order |")  # fmt: skip
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name in wanted or CASES:
        case = CASES[name]()
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "case.json"
            write(case, path)
            ours = by_dlcs(dlcs, path, "--method", "time-stepping")
            second = by_dlcs(dlcs, path)
        peers = {solver: by_petsc(name, options) for solver, options in SOLVERS.items()}
        told = "; ".join(
            f"{solver}: " + (f"{r['seconds']:.2f} ({r['newton']}, {r['krylov']}; {r['peak_mb']:.0f})" if r else "–")
            for solver, r in peers.items()
        )
        good = [r for r in peers.values() if r]
        best = min(good, key=lambda r: r["seconds"]) if good else None
        apart = max(np.abs(np.array(best["y"]) - np.array(ours["y"]))) if best else float("nan")
        ratio = f"{best['seconds'] / ours['seconds']:.1f}" if best else "–"
        sizes = f"{case['A'].shape[0]}, {case['M'].shape[0]}"
        own = f"{ours['seconds']:.2f} ({ours['peak_mb']:.0f} MB)"
        print(f"| {name} | {sizes} | {told} | {own} | {ratio} | {apart:.1e} | {second['seconds']:.2f} |", flush=True)


if __name__ == "__main__":
    if sys.argv[1] == "--petsc":
        solve_with_petsc(sys.argv[2], sys.argv[3:])
    else:
        main(sys.argv[1], sys.argv[2:])
