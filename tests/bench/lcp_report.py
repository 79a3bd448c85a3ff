# SPDX-License-Identifier: Apache-2.0
"""What lcp_bench measured, beside the figures that it should reach."""

from report_text import seconds, table, time_text, verdict

SIZES = (4, 16, 64, 255)
GOAL = 1.5  # times the figure
# Of a first program that did nothing else, with everything known at compile time, in µs; `name` of the same here, with
# {n}.
FIGURES = [
    ("dense, symmetric positive definite, warm", "BM_Unique/2/{n}", (0.02, 0.07, 1.0, 58)),
    ("Lemke, cold", "BM_Lemke/{n}", (0.12, 1.8, 29, 1150)),
    ("tridiagonal, one by one", "BM_Unique/0/{n}", (0.011, 0.056, 0.38, 2.2)),
    ("tridiagonal, a batch", "BM_TridiagonalBatch/{n}", (0.004, 0.014, 0.08, 0.49)),
]


def report_lcp(runs):
    print(
        f"Processor time of an LCP in a sequence of related ones, with its check. Goal: at most {GOAL} times the figure"
        " in brackets, of a program that did nothing else, on a quiet machine; `kept tableau`: such a program in this"
        " run, which drifts and so is no solver of ours.\n"
    )
    times = {run["name"].split("/min_time")[0]: run.get("per_lcp", seconds(run, "cpu_time")) for run in runs}
    rows = []
    for title, name, figures in FIGURES:
        row = [title]
        for n, figure in zip(SIZES, figures):
            time = times.get(name.format(n=n))
            row.append(
                f"{time_text(time)} ({figure} µs): {verdict(time <= GOAL * figure * 1e-6)}" if time is not None else "–"
            )
        rows.append(row)
    tableau = [times.get(f"BM_KeptTableau/2/{n}") for n in SIZES]
    rows.append(
        ["kept tableau, positive definite, warm", *(time_text(time) if time is not None else "–" for time in tableau)]
    )
    ours = [times.get(f"BM_Unique/2/{n}") for n in SIZES]
    rows.append(["the first row over it", *(f"{a / b:.2f}" if a and b else "–" for a, b in zip(ours, tableau))])
    print(table(["", *(f"n = {n}" for n in SIZES)], rows))
