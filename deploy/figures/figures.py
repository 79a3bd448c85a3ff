#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Remakes the figures and the table of section 4 of [Wu & Chen] from the output of dlcs.

Usage: figures.py OUT PROGRAMS CELLS MESHES
  OUT       the folder for data, pictures and README.md
  PROGRAMS  the folder of a build: client/dlcs and tests/bench/{iterates,signorini_bench} are run
  CELLS     1/Δx of figures 4.6 to 4.10 where it is fixed
  MESHES    1/Δx where it varies, separated by commas

Each figure comes with what agrees with the paper and what does not, said from the numbers that were just computed.
"""

import csv
import json
import math
import pathlib
import subprocess
import sys

OUT, PROGRAMS = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
CELLS, MESHES = int(sys.argv[3]), [int(word) for word in sys.argv[4].split(",")]
HERE = pathlib.Path(__file__).resolve().parent
EASY, HARD = (HERE.parent / "examples" / f"four-variables{suffix}.json" for suffix in ("", "-hard"))
COEFFICIENT = "2e-4"
STEPS = [200, 400, 800]  # of figure 4.6, T = 4
STEPS_OF_TIMES = [100, 200, 400, 800, 1600, 3200]  # of figure 4.10
ITERATES = 34  # of figure 4.6: (4.8) takes 31 on the mesh 1/256
FIXED_CELLS = 40  # of signorini_bench --steps
commands = []
sys.path.insert(0, str(HERE.parent.parent / "tests/bench"))
import signorini_report  # noqa: E402, of the benchmarks


def run(*words):
    """Runs a program in OUT; what it prints."""
    words = [str(word) for word in words]
    commands.append(" ".join(word.removeprefix(f"{PROGRAMS}/").replace(f"{HERE.parent}/", "deploy/") for word in words))
    done = subprocess.run(words, cwd=OUT, capture_output=True, text=True)
    if done.returncode not in (0, 1):  # 1: the mathematics has no answer, which is one
        raise RuntimeError(f"{commands[-1]}: {done.stderr}")
    return done.stdout


def solve(problem, *options):
    """The trajectory with a row of x and of y for each time, how the solve ended and, if it failed, when."""
    result = json.loads(
        run(PROGRAMS / "client/dlcs", "solve", problem, "--quiet", "--format", "json", "--no-estimate-error", *options)
    )
    times = result["trajectory"]["times"]

    def rows(values):
        width = len(values) // len(times)
        return [values[k * width : (k + 1) * width] for k in range(len(times))]

    return {
        "times": times,
        "x": rows(result["trajectory"]["x"]),
        "y": rows(result["trajectory"]["y"]),
        "termination": result["summary"]["termination"],
        "failure_time": result["summary"].get("failure_time"),
    }


def iterate(prefix, system, method, steps, count, *kept):
    """The number of iterations to convergence, and [k, error, change, log10 of the bound] of the first `count`."""
    needed = int(run(PROGRAMS / "tests/bench/iterates", system, method, steps, count, prefix, *kept))
    return needed, read(f"{prefix}-history.csv")


def read(name):
    with open(OUT / name, newline="") as file:
        return [[float(entry) if entry else math.nan for entry in row] for row in list(csv.reader(file))[1:]]


def write(name, head, rows):
    with open(OUT / name, "w", newline="") as file:
        csv.writer(file).writerows([head, *rows])


def write_trajectory(name, result):
    rows = [[t, *x, *y] for t, x, y in zip(result["times"], result["x"], result["y"])]
    states, pairs = (len(result[key][0]) for key in ("x", "y"))
    write(name, ["t", *(f"x{i + 1}" for i in range(states)), *(f"y{i + 1}" for i in range(pairs))], rows)


def draw(number, width, height, **variables):
    for picture in ("svg", "png"):
        settings = {"format": picture, "name": f"figure-{number}", "directory": str(HERE), **variables}
        text = "; ".join(f'{key}="{value}"' for key, value in settings.items()) + f"; width={width}; height={height}"
        done = subprocess.run(
            ["gnuplot", "-e", text, str(HERE / f"figure-{number}.gp")], cwd=OUT, capture_output=True, text=True
        )
        if done.returncode != 0:
            raise RuntimeError(f"figure {number}: {done.stderr}")


def largest_difference(a, b, columns):
    return max(abs(p[i] - q[i]) for p, q in zip(a, b) for i in columns)


def slope(points):
    """Of log y against log x, by least squares."""
    if len(points) < 2:
        return math.nan
    logs = [(math.log(x), math.log(y)) for x, y in points]
    mean_x, mean_y = (sum(values) / len(logs) for values in zip(*logs))
    return sum((x - mean_x) * (y - mean_y) for x, y in logs) / sum((x - mean_x) ** 2 for x, _ in logs)


def first_below(history, tolerance):
    return next((int(row[0]) for row in history if row[1] <= tolerance), math.inf)


def tell(*claims, remark=""):
    """Claims of the paper, each with whether the numbers bear it out, sorted by that."""
    parts = []
    for title, wanted in (("Agrees", True), ("Does not agree", False)):
        texts = [text for holds, text in claims if bool(holds) == wanted]
        if texts:
            parts.append(f"{title}: {'; '.join(texts)}.")
    return " ".join([*parts, remark]).strip()


def figure_4_1():
    histories = {power: iterate(f"4.1-h{power}", EASY, "wu-chen-iteration", 2**power, 22)[1] for power in (5, 7)}
    draw("4.1", 900, 400)
    counts = {power: first_below(history, 1e-12) for power, history in histories.items()}
    ratios = [b[1] / a[1] for a, b in zip(histories[7], histories[7][1:]) if b[1] > 1e-12]
    excess = max(row[3] - math.log10(row[1]) for row in histories[7] if row[1] > 1e-12)
    return tell(
        (
            ratios[-1] < max(ratios) / 2,
            (
                f"the convergence is superlinear, an iteration multiplies the error by {max(ratios):.2g} at worst and"
                f" by {ratios[-1]:.1g} in the end"
            ),
        ),
        (
            abs(counts[5] - counts[7]) <= 2,
            (
                f"it hardly depends on the step, the error is below 1e-12 after {counts[5]} iterations for h = 2⁻⁵ and "
                f"{counts[7]} for h = 2⁻⁷ "
                "(the paper shows some 19)"
            ),
        ),
        (
            excess < 3,
            (
                f"the bound of Theorem 2.2, with the Lipschitz constant of this M, lies up to 10^{excess:.0f} "
                "above the error (the paper draws it close by)"
            ),
        ),
    )


def figure_4_2():
    iterate("4.2", EASY, "wu-chen-iteration", 128, 4, 1, 2, 4)
    draw("4.2", 1000, 560)
    final = read("4.2-converged.csv")
    size = max(abs(row[i]) for row in final for i in range(1, 4))
    errors = {k: largest_difference(read(f"4.2-{k}.csv"), final, range(1, 4)) / size for k in (1, 2, 4)}
    idle = max(abs(row[i]) for row in final for i in (4, 6))
    active = [max(row[i] for row in final) for i in (5, 7)]
    return tell(
        (
            errors[4] < 0.02,
            (
                f"a few iterations suffice, the states are off by {errors[1]:.0%}, {errors[2]:.1%} and "
                f"{errors[4]:.2%} of their size after 1, 2 and 4"
            ),
        ),
        (
            idle < 1e-12 and min(active) > 0.01,
            f"y1 and y3 vanish (largest value {idle:.0g}), y2 and y4 reach {active[0]:.2g} and {active[1]:.2g}",
        ),
        remark="x0 and g are not legible in the paper, so the curves themselves are others.",
    )


def accuracy(coarse, fine, keep):
    """max_j over the nodes of `coarse`, whose nodes are every `keep`-th of `fine`, in x and in y."""
    return [max(abs(p - q) for a, b in zip(coarse[key], fine[key][::keep]) for p, q in zip(a, b)) for key in ("x", "y")]


def figure_4_3():
    def paper(steps, nodes):
        return solve(
            EASY,
            "--method",
            "wu-chen-iteration",
            "--contour-nodes",
            nodes,
            "--steps",
            steps,
            "--iteration-tolerance",
            "1e-9",
        )

    solutions = [paper(2**power, 64) for power in range(3, 10)]
    rows = [[2.0**-power, *accuracy(solutions[i], solutions[i + 1], 2)] for i, power in enumerate(range(3, 9))]
    write("4.3-steps.csv", ["h", "e_x", "e_y"], rows)
    exact = solve(EASY, "--method", "laplace-iteration", "--steps", 2048)
    nodes = [[P, *accuracy(paper(1024, P), exact, 2)] for P in range(4, 39, 4)]
    write("4.3-nodes.csv", ["P", "e_x", "e_y"], nodes)
    draw("4.3", 900, 400)
    order_x, order_y = (slope([(row[0], row[i]) for row in rows]) for i in (1, 2))
    falling = nodes[: 1 + max(i for i in range(1, len(nodes)) if nodes[i][1] < nodes[i - 1][1])]
    rate = -slope([(math.exp(math.sqrt(P)), e * math.sqrt(P)) for P, e, _ in falling])
    stop = nodes[-1][2] / nodes[-4][2]
    return tell(
        (order_x >= 0.75, f"left: e_x falls like h^{order_x:.2f} (the paper: at least like h)"),
        (order_y >= 0.75, f"left: e_y falls like h^{order_y:.2f}"),
        (all(max(row[1:]) <= 5 * row[0] for row in rows), "left: both stay below 5h"),
        (abs(rate - 2.06) < 0.4, f"right: e_x falls like e^(-{rate:.2f} √P)/√P (the paper: 2.06)"),
        (
            stop > 0.5,
            (
                f"right: e_y stops falling, at {nodes[-1][2]:.1g}, where the interpolation takes over (the paper: "
                "at some 1e-5 = h, from P = 23 on)"
            ),
        ),
        remark=(
            "On the right h = 2⁻¹⁰ in place of 1e-5, and the errors are those against exact integrals on half the step."
        ),
    )


def figure_4_4():
    results = {}
    for power in (8, 7, 6):
        for name, options in (
            ("iteration", ["--method", "laplace-iteration"]),
            ("euler", ["--method", "time-stepping", "--rule", "least-element"]),
        ):
            result = solve(HARD, "--steps", 2**power, *options)
            write_trajectory(f"4.4-{name}-{power}.csv", result)
            results[name, power] = result
    draw("4.4", 900, 620)
    reference = results["iteration", 8]
    spread = max(abs(p - q) for a, b in zip(results["iteration", 6]["y"], reference["y"][::4]) for p, q in zip(a, b))
    ends = {power: results["euler", power] for power in (8, 7, 6)}
    reached = {power: end["termination"] == "TERMINATION_REACHED_END" for power, end in ends.items()}
    stop = ends[6]["failure_time"]
    peaks = [max(row[i] for row in reference["y"]) for i in (1, 3)]
    return tell(
        (
            spread < 0.05
            and all(results["iteration", power]["termination"] == "TERMINATION_REACHED_END" for power in (8, 7, 6)),
            f"the iteration serves all three steps, y differs by {spread:.1g} between h = 2⁻⁶ and 2⁻⁸",
        ),
        (
            reached[8] and reached[7] and not reached[6],
            "implicit Euler with the least element breaks down for h = 2⁻⁶ alone, where M^h is no Z-matrix any more"
            + ("" if reached[6] else f" ({ends[6]['termination']} at t = {stop:.4g})"),
        ),
        (not reached[6] and abs(stop - 0.75) < 0.05, "the breakdown is at t = 0.75, after wrong values from 0.36 on"),
        (min(peaks) > 0.01, f"y2 and y4 are both active (they reach {peaks[0]:.1g} and {peaks[1]:.2g})"),
        remark="x0 and g are not legible in the paper; they were chosen so that the breakdown appears.",
    )


def signorini(prefix, cells, steps, count, *kept):
    return iterate(prefix, f"signorini:{cells}:{COEFFICIENT}", "laplace-iteration", steps, count, *kept)


def stop_of(cells, steps):
    return min(4 / steps, 1 / cells**2) / 10  # (4.8)


def figure_4_6():
    by_step = {steps: signorini(f"4.6-steps-{steps}", CELLS, steps, ITERATES)[1] for steps in STEPS}
    by_mesh = {cells: signorini(f"4.6-cells-{cells}", cells, 400, ITERATES)[1] for cells in MESHES[-4:]}
    draw("4.6", 950, 420, fixed_cells=CELLS, steps=" ".join(map(str, by_step)), cells=" ".join(map(str, by_mesh)))
    steps = {count: first_below(history, stop_of(CELLS, count)) for count, history in by_step.items()}
    meshes = {cells: first_below(history, stop_of(cells, 400)) for cells, history in by_mesh.items()}
    rates = [history[3][1] / history[2][1] for history in by_step.values()]
    return tell(
        (
            max(rates) < 1.1 * min(rates),
            "the rate does not depend on the step, (4.8) is met after "
            + ", ".join(f"{k} iterations (h = {4 / count:g})" for count, k in steps.items())
            + f" with Δx = 1/{CELLS}",
        ),
        (
            list(meshes.values()) == sorted(meshes.values()),
            "finer meshes take more iterations: "
            + ", ".join(f"{k} (1/{cells})" for cells, k in meshes.items())
            + " with h = 0.01",
        ),
        (
            CELLS == 40 and abs(steps[400] - 5) <= 1,
            f"the paper needs five at Δx = 1/40, here it is {steps[400]} at 1/{CELLS}",
        ),
        remark=(
            f"c = {COEFFICIENT}, and (4.8), the dotted lines, is read as max_j ‖x_j^k - x_j‖ <= min(h, Δx²)/10: "
            "neither is legible. The first iterate "
            "belongs to y frozen at its first value where the paper's belongs to x frozen."
        ),
    )


def psi(x2, t):
    return math.sin(4 * math.pi * t) if abs(x2 - 0.5) <= 0.25 else math.sin(2 * math.pi * t)


def boundary(name):
    """[t, x2, V(0, x2, t)], from y = V - ψ."""
    return [[[row[0], q / CELLS, y + psi(q / CELLS, row[0])] for q, y in enumerate(row[1:], 1)] for row in read(name)]


def figures_4_7_and_4_8():
    signorini("4.7", CELLS, 400, 5, 1, 3, 5)
    names = ["1", "3", "5", "converged"]
    surfaces = {name: boundary(f"4.7-{name}.csv") for name in names}
    for name, surface in surfaces.items():
        with open(OUT / f"4.7-{name}-surface.csv", "w") as file:
            # Every fourth time, a block for each: as gnuplot reads a surface.
            file.writelines("".join(f"{t},{x2},{v}\n" for t, x2, v in line) + "\n" for line in surface[::4])
    draw("4.7", 1000, 800)
    last = [surfaces[name][-1] for name in names]
    write(
        "4.8-space.csv",
        ["x2", "1", "3", "5", "converged"],
        [[points[0][1], *(p[2] for p in points)] for points in zip(*last)],
    )
    middle = CELLS // 2 - 1
    write(
        "4.8-time.csv",
        ["t", "1", "3", "5", "converged"],
        [[lines[0][middle][0], *(line[middle][2] for line in lines)] for lines in zip(*surfaces.values())],
    )
    draw("4.8", 950, 400)
    errors = {
        name: max(abs(p[2] - q[2]) for a, b in zip(surfaces[name], surfaces["converged"]) for p, q in zip(a, b))
        for name in names[:-1]
    }
    at_end = {
        name: max(abs(p[2] - q[2]) for p, q in zip(surfaces[name][-1], surfaces["converged"][-1]))
        for name in names[:-1]
    }

    def compare(errors):
        return ", ".join(f"{error:.1g} (k = {name})" for name, error in errors.items())

    remark = f"Δx = 1/{CELLS}, h = 0.01, c = {COEFFICIENT}; ψ is hardly legible in the paper, so the bulges are others."
    return {
        "4.7": tell(
            (errors["5"] < 0.02, "the fifth iterate is the converged solution to the eye"),
            (errors["1"] > 0.02, f"the first is not; on the boundary the iterates are off by {compare(errors)}"),
            remark=remark,
        ),
        "4.8": tell(
            (
                at_end["5"] < 0.01 < at_end["1"],
                f"the first iterate differs visibly at t = 4, the fifth does not: {compare(at_end)}",
            ),
            remark=remark,
        ),
    }


def figure_4_10_and_table_4_1():
    way, number = "(iteration, whole window|march|time-stepping)", f"{float(COEFFICIENT):g}"
    run(
        PROGRAMS / "tests/bench/signorini_bench",
        f"--cells={','.join(map(str, MESHES))}",
        f"--steps={','.join(map(str, [400, *(J for J in STEPS_OF_TIMES if J != 400)]))}",
        f"--benchmark_filter=^{way}.*.{number}/",
        "--benchmark_out=signorini.json",
        "--benchmark_out_format=json",
        "--benchmark_min_time=0.05",
    )
    measured = [
        entry
        for entry in json.loads((OUT / "signorini.json").read_text())["benchmarks"]
        if not entry.get("error_occurred")
    ]
    settings = {key[1:]: ways for key, ways in signorini_report.by_setting(measured).items()}
    names = ["iteration, whole window", "march", "time-stepping"]
    seconds = lambda ways: [signorini_report.total(ways.get(name)) for name in names]
    fixed = FIXED_CELLS if FIXED_CELLS in MESHES else MESHES[-1]
    tables = {
        "steps": [[J, *seconds(settings[fixed, J])] for J in STEPS_OF_TIMES if (fixed, J) in settings],
        "cells": [[cells, *seconds(settings[cells, 400])] for cells in MESHES],
    }
    for what, rows in tables.items():
        write(f"4.10-{what}.csv", [what, *names], [["" if value != value else value for value in row] for row in rows])
    draw("4.10", 950, 420, fixed_cells=fixed)
    growth = {
        what: [slope([(row[0], row[i]) for row in rows[-4:] if row[i] == row[i]]) for i in (1, 2, 3)]
        for what, rows in tables.items()
    }
    finest = [row for row in tables["cells"] if all(value == value for value in row)][-1]
    text = tell(
        (
            growth["steps"][0] < 0.2,
            (
                f"with more steps the time of the iteration grows like J^{growth['steps'][0]:.2f} (the paper: it stays,"
                " on 960 cores; here on one thread)"
            ),
        ),
        (abs(growth["steps"][2] - 1) < 0.3, f"the time of implicit Euler grows like J^{growth['steps'][2]:.2f}"),
        (
            min(growth["cells"][0], growth["cells"][2]) > 0,
            f"both times grow for finer meshes, like Δx^-{growth['cells'][0]:.1f} and Δx^-{growth['cells'][2]:.1f}",
        ),
        (
            finest[1] < finest[3],
            (
                f"at Δx = 1/{finest[0]} the iteration takes {finest[1] / finest[3]:.2g} times as long as implicit Euler"
                " (the paper: 1.4 hours against 15 on its finest mesh)"
            ),
        ),
        remark=(
            f"The march, which has the iteration's answer, takes {finest[2] / finest[3]:.2g} times as long as implicit"
            " Euler there. Implicit Euler is the engine's, with a sparse factor of I - hA."
        ),
    )
    share = [
        ways[names[0]]["lcp_ms"] / ways[names[0]]["total_ms"]
        for (cells, J), ways in sorted(settings.items())
        if J == 400
    ]
    parts = [
        signorini_report.step_table(measured, number, fixed),
        signorini_report.paper_table("steps"),
        signorini_report.mesh_table(measured, number),
        signorini_report.paper_table("cells"),
    ]
    heads = [
        f"Case I, Δx = 1/{fixed}:",
        "the paper's, on a GTX 660 (other hardware):",
        "Case II, h = 0.01:",
        "the paper's, on a GTX 660 (other hardware):",
    ]
    lines = "\n".join(f"{head}\n\n{part}" for head, part in zip(heads, parts))
    (OUT / "table-4.1.md").write_text(lines)
    table = tell(
        (
            share[0] > share[-1],
            (
                f"the share of the LCPs goes from {share[0]:.0%} to {share[-1]:.0%} as Δx falls (the paper: from 47 % "
                "to 23 %)"
            ),
        ),
        remark=(
            "Interpolation, a row of the paper, is part of the kernel here; one thread has nobody to talk to; LCPs"
            f" with tridiagonal M cost next to nothing.\n\n{lines}"
        ),
    )
    return {"4.10": text, "Table 4.1": table}


def main():
    OUT.mkdir(parents=True, exist_ok=True)
    sections = {
        "4.1": figure_4_1(),
        "4.2": figure_4_2(),
        "4.3": figure_4_3(),
        "4.4": figure_4_4(),
        "4.6": figure_4_6(),
        **figures_4_7_and_4_8(),
        **figure_4_10_and_table_4_1(),
    }
    text = [
        "# Section 4 of [Wu & Chen], remade\n",
        (
            "S.-L. Wu, X. Chen, *A parallel iterative algorithm for differential linear complementarity problems*. The"
            " data of (4.2) and (4.7) that the paper does not show legibly are chosen"
            " (`deploy/examples/four-variables*.json`, `dlcs`'s Signorini model). Every picture is there as SVG and"
            " PNG, its data beside it as CSV. Below each stands which of the paper's statements our numbers bear out.\n"
        ),
    ]
    for number, sentence in sections.items():
        picture = [] if number.startswith("Table") else [f"![Figure {number}](figure-{number}.png)\n"]
        text += [f"## {number if number.startswith('Table') else 'Figure ' + number}\n", *picture, sentence + "\n"]
    text += ["## Commands\n", "\n".join(f"    {command}" for command in commands) + "\n"]
    (OUT / "README.md").write_text("\n".join(text))


if __name__ == "__main__":
    main()
