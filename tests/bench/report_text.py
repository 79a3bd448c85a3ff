# SPDX-License-Identifier: Apache-2.0
"""Numbers and tables as the reports write them, and what is read off Google Benchmark's JSON."""

import math


def seconds(run, clock="real_time"):
    return run[clock] * {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1}[run["time_unit"]]


def time_text(value):
    for unit, scale in (("h", 3600), ("min", 60), ("s", 1), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= scale:
            return f"{value / scale:.3g} {unit}"
    return f"{value / 1e-9:.3g} ns"


def bytes_text(value):
    for unit, scale in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if value >= scale:
            return f"{value / scale:.3g} {unit}"
    return f"{value:.0f} B"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def verdict(met):
    return "met" if met else "**missed**"


def best(runs, clock="real_time"):
    """Of repetitions: what disturbs a run only makes it longer."""
    return min(seconds(run, clock) for run in runs)


def grouped(runs, depth):
    """Runs by the first `depth` parts of their names, in their order."""
    groups = {}
    for run in runs:
        groups.setdefault(tuple(run["name"].split("/")[:depth]), []).append(run)
    return groups


def exponent(points):
    """Of y ~ x^p, by least squares over the last decade of x (at least three points)."""
    points = [(x, y) for x, y in points if y > 0]
    last = [p for p in points if p[0] >= points[-1][0] / 10] if points else []
    last = last if len(last) >= 3 else points[-3:]
    if len(last) < 2:
        return math.nan
    logs = [(math.log(x), math.log(y)) for x, y in last]
    mean_x, mean_y = (sum(values) / len(logs) for values in zip(*logs))
    return sum((x - mean_x) * (y - mean_y) for x, y in logs) / sum((x - mean_x) ** 2 for x, _ in logs)
