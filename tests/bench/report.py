#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Puts what the benchmarks measured (Google Benchmark's JSON) into one Markdown report.

Usage: report.py FOLDER > REPORT, with FOLDER/NAME.json for each program and FOLDER/machine.md for the head.
A benchmark that failed its check stands at the end under its reason, and the exit code is 1.
"""

import json
import math
import pathlib
import sys

GOAL_OVERHEAD = 0.05
GOAL_STREAM = 0.80


def seconds(run, clock="real_time"):
    return run[clock] * {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1}[run["time_unit"]]


def time_text(value):
    for unit, scale in (("s", 1), ("ms", 1e-3), ("µs", 1e-6)):
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
    return sum((x - mean_x) * (y - mean_y) for x, y in logs) / sum((x - mean_x)**2 for x, _ in logs)


def report_growth(runs):
    print("Processor time and peak memory (resident set, above what the process had before) of one solve on one thread. The exponents "
          "are fitted over the last decade; the expected ones are those of the costliest part, which may not rule yet.\n")
    rows = []
    for (letter, method), family in grouped(runs, 2).items():
        times = [(run["size"], seconds(run, "cpu_time")) for run in family]
        memory = [(run["size"], run["peak_bytes"]) for run in family]
        rows.append([
            letter, method, f"{times[0][0]:.0f} … {times[-1][0]:.0f}",
            f"{time_text(times[0][1])} … {time_text(times[-1][1])}", f"{exponent(times):.2f}", f"{family[0]['expected_time']:.0f}",
            f"{bytes_text(memory[0][1])} … {bytes_text(memory[-1][1])}", f"{exponent(memory):.2f}",
            f"{family[0]['expected_memory']:.0f}"])
    print(table(["of", "method", "sizes", "time", "exponent", "expected", "memory", "exponent", "expected"], rows))


def report_service(runs):
    overhead = [run for run in runs if run["name"].startswith("overhead/")]
    print(f"The same solve in the engine and through a server over loopback. Goal: at most {GOAL_OVERHEAD:.0%} more for a solve of 10 ms "
          "and more. Best of the repetitions; processor time is that of engine, server and client together.\n")
    rows = []
    for (_, name), members in grouped(overhead, 2).items():
        ways = {way: group for (_, _, way), group in grouped(members, 3).items()}
        engine, service = best(ways["engine"]), best(ways["service"])
        work = best(ways["service"], "cpu_time") / best(ways["engine"], "cpu_time") - 1
        rows.append([name, time_text(engine), time_text(best(ways["local"])), time_text(service),
                     f"{service / engine - 1:+.1%}", f"{work:+.1%}", verdict(service <= engine * (1 + GOAL_OVERHEAD))])
    print(table(["solve", "engine", "in process, as messages", "service", "overhead", "in processor time", "goal"], rows))

    print(f"Streams, from the first message to the end. Goal: at least {GOAL_STREAM:.0%} of a bare gRPC stream of the same messages; "
          "where the engine makes them more slowly than that, of the engine.\n")
    rows = []
    for (_, name), members in grouped([run for run in runs if run["name"].startswith("stream/")], 2).items():
        rates = {way: max(run["messages_per_s"] for run in group) for (_, _, way), group in grouped(members, 3).items()}
        volume = {way: max(run["bytes_per_s"] for run in group) for (_, _, way), group in grouped(members, 3).items()}
        bound = min(rates["bare"], rates["engine"]) if name == "iterates" else rates["bare"]
        rows.append([name, f"{rates['engine']:.0f}", f"{rates['bare']:.0f}", f"{rates['service']:.0f}",
                     f"{volume['bare'] / 1e9:.3f}", f"{volume['service'] / 1e9:.3f}", f"{rates['service'] / bound:.0%}",
                     verdict(rates["service"] >= GOAL_STREAM * bound)])
    print(table(["stream", "engine, messages/s", "bare, messages/s", "service, messages/s", "bare, GB/s", "service, GB/s",
                 "of the bound", "goal"], rows))


def report_plain(runs):
    rows = [[run["name"], time_text(seconds(run)), time_text(seconds(run, "cpu_time"))] for run in runs]
    print(table(["benchmark", "time", "processor time"], rows))


# In the order of the report; a program that is not named here gets a plain table at the end.
CHAPTERS = {
    "lcp_bench": ("Linear complementarity problems", report_plain),
    "growth_bench": ("Growth with steps, pairs and states", report_growth),
    "service_bench": ("What the service costs", report_service),
}


def main(folder):
    print((folder / "machine.md").read_text())
    files = {path.stem: path for path in sorted(folder.glob("*.json"))}
    failures = []
    for name in [*(name for name in CHAPTERS if name in files), *(name for name in files if name not in CHAPTERS)]:
        title, report = CHAPTERS.get(name, (name, report_plain))
        text = files[name].read_text()
        print(f"## {title}\n\n`{name}`\n")
        if not text:
            failures.append((name, "the program gave no results"))
            continue
        runs = [run for run in json.loads(text)["benchmarks"] if run.get("run_type") != "aggregate"]
        failures += [(f"{name}: {run['name']}", run["error_message"]) for run in runs if run.get("error_occurred")]
        good = [run for run in runs if not run.get("error_occurred")]
        if good:
            report(good)
    print("## Answers that failed their check\n")
    print("\n".join(f"- `{name}`: {why}" for name, why in failures) or "None.")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
