# SPDX-License-Identifier: Apache-2.0
"""What signorini_bench measured, beside the times and the shares that [Wu & Chen] print."""

import math

from report_text import table, time_text, verdict

MARCH, WHOLE, SINE, CHOLESKY = (
    "march",
    "iteration, whole window",
    "implicit Euler, sine transform",
    "implicit Euler, sparse Cholesky",
)
SPLIT = [WHOLE, "iteration, windows", MARCH]
GOAL_MARCH, GOAL_ITERATION = 300, 50  # times faster than sparse Cholesky, at 1/256
GOAL_CELLS, EASY = 256, "0.0002"

# Section 4.2 of the paper, T = 4, h = 0.01, in seconds by 1/Δx.
PAPER_TIMES = {
    "iteration, a GTX 660": {40: 30.1, 256: 1.4 * 3600},
    "implicit Euler, an i7-3770K": {40: 27.5 * 60, 256: 15 * 3600},
}
# Its Table 4.1, in percent, from the longest to the shortest step at Δx = 1/40, and from the coarsest to the finest
# mesh at h = 0.01. The steps and the third mesh are not legible.
PAPER_TABLE = {
    "steps": {
        "LCP solver": [47.5, 48.8, 46.1, 42.8, 35.6, 32.0],
        "linear algebra": [35.7, 34.7, 39.5, 42.4, 50.7, 53.7],
        "interpolation": [4.5, 4, 4.3, 4.1, 4, 4.1],
        "communication": [12.3, 12.5, 10.1, 10.7, 9.7, 10.2],
    },
    "cells": {
        "LCP solver": [46.9, 46.1, 49.3, 40.1, 30.2, 22.8],
        "linear algebra": [37.9, 37.3, 34.1, 40.2, 51.7, 56.8],
        "interpolation": [4.5, 4.7, 5.1, 6.3, 6.6, 7],
        "communication": [10.7, 11.9, 14.2, 13.4, 11.5, 13.4],
    },
}
PAPER_MESHES = [16, 32, None, 64, 128, 256]


def by_setting(runs):
    """{(coefficient, cells, steps): {way: run}}, in the order of the runs."""
    settings = {}
    for run in runs:
        way, cells, steps, coefficient = run["name"].split("/min_time")[0].split("|")
        settings.setdefault((coefficient, int(cells), int(steps)), {})[way] = run
    return settings


def total(run):
    return run["total_ms"] * 1e-3 if run else math.nan


def cell(run):
    return f"{time_text(total(run))}{'*' if 'extrapolated' in run else ''}" if run else "–"


def split_of(run):
    """[title, seconds] of a run: the rows of the paper's table, and what it does not have."""
    lcp, linear, setup, certificate = (run[f"{part}_ms"] * 1e-3 for part in ("lcp", "linear", "setup", "certificate"))
    return [
        ("LCP solver", lcp),
        ("linear algebra, states included", linear),
        ("kernel and sources, integrals of the interpolant included", setup),
        ("certificate", certificate),
        ("checks, classes", total(run) - lcp - linear - setup - certificate),
    ]


def split_table(runs, heads):
    rows = []
    for k, (title, _) in enumerate(split_of(runs[0]) if runs else []):
        parts = [max(split_of(run)[k][1], 0) for run in runs]
        rows.append([title, *(f"{time_text(part)} ({part / total(run):.0%})" for run, part in zip(runs, parts))])
    rows.append(["communication", *("none, one thread" for _ in runs)])
    rows.append(["iterations", *(f"{run['rounds']:.0f}" if run["rounds"] else "none" for run in runs)])
    return table(["", *heads], rows)


def mesh_table(runs, coefficient, way=WHOLE):
    """Table 4.1 against the mesh."""
    settings = {
        cells: ways[way]
        for (c, cells, steps), ways in by_setting(runs).items()
        if c == coefficient and steps == 400 and way in ways
    }
    return split_table(list(settings.values()), [f"Δx = 1/{cells}" for cells in settings])


def step_table(runs, coefficient, cells, way=WHOLE):
    """Table 4.1 against the step."""
    settings = {
        steps: ways[way]
        for (c, of, steps), ways in sorted(by_setting(runs).items())
        if c == coefficient and of == cells and way in ways
    }
    return split_table(list(settings.values()), [f"h = {4 / steps:g}" for steps in settings])


def paper_table(against):
    heads = {
        "cells": [f"Δx = 1/{cells}" if cells else "Δx = ?" for cells in PAPER_MESHES],
        "steps": ["longest step", "", "", "", "", "shortest step"],
    }
    rows = [[title, *(f"{share:g} %" for share in shares)] for title, shares in PAPER_TABLE[against].items()]
    return table(["", *heads[against]], rows)


def goals(settings):
    texts = []
    for (coefficient, cells, _), ways in settings.items():
        if cells != GOAL_CELLS or not {MARCH, SINE, CHOLESKY} <= ways.keys():
            continue
        march, sine, cholesky = (total(ways[way]) for way in (MARCH, SINE, CHOLESKY))
        texts.append(
            f"c = {coefficient}, 1/{cells}: the march is {cholesky / march:.0f} times faster than sparse Cholesky (goal"
            f" {GOAL_MARCH}): {verdict(cholesky >= GOAL_MARCH * march)}; it takes {march / sine:.2f} times as long as"
            f" sine transforms (goal: at most 1): {verdict(sine >= march)}."
        )
        if coefficient == EASY and WHOLE in ways:
            whole = total(ways[WHOLE])
            texts.append(
                f"c = {coefficient}, 1/{cells}: the iteration with one window is {cholesky / whole:.0f} times faster"
                f" than sparse Cholesky (goal {GOAL_ITERATION}): {verdict(cholesky >= GOAL_ITERATION * whole)}."
            )
    return texts or [f"No goal was measured: they are for 1/{GOAL_CELLS}."]


def report_signorini(runs):
    settings = by_setting(runs)
    print(
        "The parabolic Signorini problem of [Wu & Chen], T = 4. Processor time on one thread, set-up included, best of"
        " the runs. The iterations stop at (4.8) of the paper; the march has their answer to rounding; `time-stepping`"
        " is the engine's implicit Euler, the two forms beside it are done well for this problem, with LCPs by factors"
        " of a band. `*`: extrapolated from the first steps, or, of the iteration as printed (a contour for each time,"
        " its LCPs not counted), from some states of one iterate. `–`: left out, because it takes long (event location"
        " serves up to some 200 states).\n"
    )
    ways = list(dict.fromkeys(run["name"].split("|")[0] for run in runs))
    rows = [
        [coefficient, f"1/{cells}", f"{steps}", *(cell(of.get(way)) for way in ways)]
        for (coefficient, cells, steps), of in settings.items()
    ]
    print(table(["c", "Δx", "J", *ways], rows))
    print(
        "The paper's own times (other hardware): "
        + "; ".join(
            f"{who}: " + ", ".join(f"{time_text(time)} at 1/{cells}" for cells, time in times.items())
            for who, times in PAPER_TIMES.items()
        )
        + ".\n"
    )
    print("\n".join(f"- {text}" for text in goals(settings)) + "\n")
    print("### Table 4.1 of the paper: where the time goes\n")
    for coefficient in dict.fromkeys(key[0] for key in settings):
        for way in SPLIT:
            print(f"{way}, c = {coefficient}:\n\n{mesh_table(runs, coefficient, way)}")
    print(f"The paper's, on a GTX 660 (other hardware):\n\n{paper_table('cells')}")
