#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Large sparse systems: PETSc beside `dlcs solve`.

Usage: petsc_bench.py DLCS [--ranks 2] [CASE...]
       petsc_bench.py DLCS --error 1e-5 [CASE...]

Needs python3-petsc4py, numpy and scipy of Debian, which nothing else here needs. Each of PETSc's linear solvers runs in
a process of its own, with a limit of time; wall time is that of the steps, without reading and writing. The reports
are tables in Markdown; a "ratio" is the time of the quickest solver of PETSc over ours.

The first form takes equal steps of implicit Euler: PETSc's TS beuler with SNES vinewtonrsls takes the same ones, and
the largest difference of y at T is printed. With --ranks PETSc runs on so many ranks and `dlcs` on as many threads.

The second compares times for the same error of the states at ten times, relative to their largest component, where
steps are as many as are needed in hindsight. The reference has eight times the steps that `dlcs` needs; that PETSc's
schemes come to it as well is the check of it. Implicit Euler: the steps follow from the error of 400 steps, and the
time from the first 200 of them. Beside it stands the time with --tolerance, which finds the steps and proves the error.
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
SOLVERS_ON_RANKS = SOLVERS | {
    "GMRES, ILU": "-ksp_type gmres -pc_type bjacobi -sub_pc_type ilu",
    "LU": "-ksp_type preonly -pc_type lu -pc_factor_mat_solver_type mumps",
}
EULER = "-ts_type beuler"
SECOND_ORDER = {
    "BDF2": "-ts_type bdf -ts_bdf_order 2",
    "midpoint rule": "-ts_type theta -ts_theta_theta 0.5",
    "ARKIMEX L2": "-ts_type arkimex -ts_arkimex_type l2 -ts_arkimex_fully_implicit",
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
TIMES = 10  # whose states are compared


def as_json(matrix):
    matrix = sp.coo_matrix(matrix)
    return {"rows": matrix.shape[0], "columns": matrix.shape[1], "row_indices": matrix.row.tolist(),
            "column_indices": matrix.col.tolist(), "values": matrix.data.tolist()}  # fmt: skip


def write(case, path):
    content = {name: as_json(case[name]) for name in "ABNM"}
    for name in "fg":
        content[name] = {"matrix": as_json(case[name]), "of": [FORMULA]}
    path.write_text(json.dumps(content | {"x0": case["x0"].tolist(), "T": HORIZON}))


def solve_with_petsc(name, steps, horizon, options):
    """Prints seconds, Newton and Krylov iterations, memory and the solution at the end as JSON, from the first rank."""
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
    world = PETSc.COMM_WORLD
    begin = (m + n) * world.rank // world.size
    end = (m + n) * (world.rank + 1) // world.size
    K = K[begin:end]
    K.sort_indices()
    A = PETSc.Mat().createAIJ(((end - begin, m + n), (end - begin, m + n)),
                              csr=(K.indptr.astype("i4"), K.indices.astype("i4"), K.data), comm=world)  # fmt: skip
    J = A.duplicate(copy=True)
    is_state = np.arange(begin, end) < m
    source_of = np.concatenate([-case["f"][:, 0], case["g"][:, 0]])[begin:end]
    mass = A.createVecLeft()
    mass.getArray()[:] = is_state

    def residual(ts, t, u, rate, F):
        A.mult(u, F)
        out = F.getArray()
        out[is_state] += rate.getArray(readonly=True)[is_state]
        out += source_of * (np.sin(2 * np.pi * t) / 2)

    def jacobian(ts, t, u, rate, shift, matrix, preconditioner):
        A.copy(preconditioner)
        diagonal = preconditioner.getDiagonal()
        diagonal.axpy(shift, mass)
        preconditioner.setDiagonal(diagonal)
        preconditioner.assemble()
        return True

    ts = PETSc.TS().create(world)
    ts.setIFunction(residual, A.createVecLeft())
    ts.setIJacobian(jacobian, J)
    ts.setTimeStep(horizon / steps)
    ts.setMaxSteps(steps)
    ts.setMaxTime(2 * horizon)
    newton = ts.getSNES()
    newton.setType("vinewtonrsls")
    low, high = A.createVecLeft(), A.createVecLeft()
    low.getArray()[:] = np.where(is_state, -1e20, 0)
    high.set(1e20)
    newton.setVariableBounds(low, high)
    newton.setTolerances(rtol=1e-9, atol=1e-10)
    ts.setFromOptions()  # the scheme, and that its steps are equal
    states = []
    u = A.createVecLeft()
    to_first, gathered = PETSc.Scatter.toZero(u)

    def record(ts, step, t, u):
        if step > 0 and step % (steps // TIMES) == 0:
            to_first.scatter(u, gathered)
            if world.rank == 0:
                states.append(gathered.getArray().copy())

    ts.setMonitor(record)
    u.getArray()[:] = np.concatenate([case["x0"], np.zeros(n)])[begin:end]
    begun = time.perf_counter()
    ts.solve(u)
    seconds = time.perf_counter() - begun
    good = ts.getStepNumber() == steps and ts.getConvergedReason() > 0
    if world.rank > 0:
        return
    peak = next(int(l.split()[1]) for l in open("/proc/self/status") if l.startswith("VmHWM"))
    result = {"seconds": seconds, "good": good, "newton": ts.getSNESIterations(), "krylov": ts.getKSPIterations()}
    result |= {"peak_mb": peak / 1024, "y": states[-1][m:].tolist()}
    print(json.dumps(result | {"x": np.concatenate([state[:m] for state in states]).tolist()}))


def by_petsc(name, options, steps=STEPS, horizon=HORIZON, ranks=1):
    command = [sys.executable, __file__, "--petsc", name, str(steps), str(horizon), "-ts_adapt_type", "none",
               *options.split()]  # fmt: skip
    if ranks > 1:
        command = ["mpirun", "--allow-run-as-root", "-n", str(ranks), *command]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
        result = json.loads(done.stdout)
        return result if result["good"] else None
    except (subprocess.TimeoutExpired, json.JSONDecodeError):
        return None


def by_dlcs(dlcs, path, *options, times=1, threads=1):
    at = ",".join(f"{HORIZON * k / times:g}" for k in range(1, times + 1))
    command = [dlcs, "solve", str(path), "--at", at, "--threads", str(threads), "--quiet", "--no-estimate-error",
               "--format", "json", *options]  # fmt: skip
    result = json.loads(subprocess.run(command, capture_output=True, text=True, check=False).stdout)
    summary, cost = result["summary"], result["summary"]["cost"]
    return {"seconds": cost["seconds_total"], "peak_mb": int(cost["process_peak_bytes"]) / 1e6,
            "steps": summary.get("steps"), "x": result["trajectory"]["x"], "y": result["trajectory"]["y"]}  # fmt: skip


def quickest(results):
    good = [r for r in results if r]
    return min(good, key=lambda r: r["seconds"]) if good else None


def with_same_steps(dlcs, name, path, ranks):
    ours = by_dlcs(dlcs, path, "--steps", str(STEPS), "--method", "time-stepping", threads=ranks)
    second = by_dlcs(dlcs, path, "--steps", str(STEPS), threads=ranks)
    solvers = SOLVERS if ranks == 1 else SOLVERS_ON_RANKS
    peers = {solver: by_petsc(name, EULER + " " + options, ranks=ranks) for solver, options in solvers.items()}
    all_peers = "; ".join(
        f"{solver}: " + (f"{r['seconds']:.2f} ({r['newton']}, {r['krylov']}; {r['peak_mb']:.0f})" if r else "–")
        for solver, r in peers.items()
    )
    best = quickest(peers.values())
    apart = max(np.abs(np.array(best["y"]) - np.array(ours["y"]))) if best else float("nan")
    ratio = f"{best['seconds'] / ours['seconds']:.1f}" if best else "–"
    own = f"{ours['seconds']:.2f} ({ours['peak_mb']:.0f} MB)"
    return f"{all_peers} | {own} | {ratio} | {apart:.1e} | {second['seconds']:.2f}"


def with_same_error(dlcs, name, path, error):
    def solve(*options):
        return by_dlcs(dlcs, path, *options, times=TIMES)

    def error_of(result):
        return np.abs(np.array(result["x"]) - reference).max() / np.abs(reference).max()

    def least_steps(run, least):
        """The run with as few steps as the error allows, by doubling and then by the observed order."""
        steps, before = least, None
        while steps <= 64 * least:
            result = run(steps)
            if result is None:
                return None, steps
            reached = error_of(result)
            if reached <= error:
                share = np.log(before / error) / np.log(before / reached) if before else 1
                fewer = TIMES * int(np.ceil(steps / 2 * 2**share / TIMES))
                return run(fewer) if fewer < steps else result, fewer
            before = reached
            steps *= 2
        return None, steps

    certified = solve("--tolerance", str(error))
    reference = np.array(certified["x"])
    _, steps = least_steps(lambda steps: solve("--steps", str(steps)), 50)
    reference = np.array(solve("--steps", str(8 * steps))["x"])
    ours, steps = least_steps(lambda steps: solve("--steps", str(steps)), 50)
    columns = [
        f"{certified['seconds']:.2f} ({error_of(certified):.1e})",
        f"{ours['seconds']:.2f} ({steps} steps, {error_of(ours):.1e})",
    ]

    coarse = by_petsc(name, EULER + " " + SOLVERS["GMRES, ILU"], 400)
    needed = int(400 * error_of(coarse) / error)
    horizon = HORIZON * 200 / needed
    begin = quickest([by_petsc(name, f"{EULER} {options}", 200, horizon) for options in SOLVERS.values()])
    seconds = begin["seconds"] * needed / 200
    columns += [f"{seconds:.0f} ({needed} steps)", f"{seconds / ours['seconds']:.0f}"]

    runs = {}
    for scheme, options in SECOND_ORDER.items():
        gmres = SOLVERS["GMRES, ILU"]
        best, needed = least_steps(lambda steps, by=f"{options} {gmres}": by_petsc(name, by, steps), 50)
        others = [by_petsc(name, f"{options} {other}", needed) for other in SOLVERS.values() if other != gmres]
        good = [run for run in [best, *others] if run and error_of(run) <= 1.2 * error]
        if good:
            runs[scheme] = quickest(good) | {"steps": needed}
    columns += [
        f"{scheme}: {run['seconds']:.2f} ({run['steps']} steps, {error_of(run):.1e})" for scheme, run in runs.items()
    ] or ["–"]
    columns[4:] = ["; ".join(columns[4:])]
    columns.append(f"{quickest(runs.values())['seconds'] / ours['seconds']:.1f}" if runs else "–")
    return " | ".join(columns)


def main(dlcs, arguments):
    ranks, error = 1, None
    if arguments[:1] == ["--ranks"]:
        ranks, arguments = int(arguments[1]), arguments[2:]
    elif arguments[:1] == ["--error"]:
        error, arguments = float(arguments[1]), arguments[2:]
    if error:
        print("| case | states, pairs | dlcs --tolerance: seconds (error) | dlcs --steps | PETSc, implicit Euler "
              "| ratio | PETSc, second order | ratio |")  # fmt: skip
        print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    else:
        print("| case | states, pairs | PETSc: seconds (Newton, Krylov iterations; MB of the first rank) "
              "| dlcs, the same steps | ratio | y apart | dlcs, second order |")  # fmt: skip
        print("| --- | --- | --- | --- | --- | --- | --- |")
    for name in arguments or CASES:
        case = CASES[name]()
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "case.json"
            write(case, path)
            row = with_same_error(dlcs, name, path, error) if error else with_same_steps(dlcs, name, path, ranks)
        print(f"| {name} | {case['A'].shape[0]}, {case['M'].shape[0]} | {row} |", flush=True)


if __name__ == "__main__":
    if sys.argv[1] == "--petsc":
        solve_with_petsc(sys.argv[2], int(sys.argv[3]), float(sys.argv[4]), sys.argv[5:])
    else:
        main(sys.argv[1], sys.argv[2:])
