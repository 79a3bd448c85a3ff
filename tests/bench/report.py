#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Puts what the benchmarks measured (Google Benchmark's JSON) into one Markdown report.

Usage: report.py FOLDER > REPORT, with FOLDER/NAME.json for each program and FOLDER/machine.md for the head.
A benchmark that failed its check stands at the end under its reason, and the exit code is 1.
"""

import contextlib
import io
import json
import pathlib
import re
import sys

from lcp_report import report_lcp
from report_text import best, bytes_text, exponent, grouped, seconds, table, time_text, verdict
from signorini_report import report_signorini

GOAL_OVERHEAD = 0.05
GOAL_ITERATES = 0.03
GOAL_STREAM = 0.80
GOAL_RATIOS = {4: 10, 6: 100, 9: 10_000}  # of implicit Euler's time, by digits
GOAL_CHOICE = 1.5  # times the best explicit choice
SMALL = 6  # states
MODELED = (2, 16, 32, 64, 128)  # processors, of threads_bench
NOT_NEEDED = "not needed"  # the run would have told nothing new


def report_growth(runs):
    print(
        "Processor time and peak memory (resident set, above what the process had before) of one solve on one "
        "thread. The exponents "
        "are fitted over the last decade; the expected ones are those of the costliest part, which may not rule "
        "yet.\n"
    )
    rows = []
    for (letter, method), family in grouped(runs, 2).items():
        times = [(run["size"], seconds(run, "cpu_time")) for run in family]
        memory = [(run["size"], run["peak_bytes"]) for run in family]
        rows.append(
            [
                letter,
                method,
                f"{times[0][0]:.0f} … {times[-1][0]:.0f}",
                f"{time_text(times[0][1])} … {time_text(times[-1][1])}",
                f"{exponent(times):.2f}",
                f"{family[0]['expected_time']:g}",
                f"{bytes_text(memory[0][1])} … {bytes_text(memory[-1][1])}",
                f"{exponent(memory):.2f}",
                f"{family[0]['expected_memory']:g}",
            ]
        )
    print(table(["of", "method", "sizes", "time", "exponent", "expected", "memory", "exponent", "expected"], rows))


def ways_of(runs, family):
    """Of the runs of a family: the name of each case, and the runs of each way to do it."""
    of_family = [run for run in runs if run["name"].startswith(family + "/")]
    for (_, name), members in grouped(of_family, 2).items():
        yield name, {way: group for (_, _, way), group in grouped(members, 3).items()}


def least(runs, counter):
    """Of repetitions, in seconds."""
    return min(run[counter] for run in runs) / 1e3


def report_overhead(runs):
    print(
        f"The same solve in the engine and through a server over loopback. Goal: at most {GOAL_OVERHEAD:.0%} more "
        "for a solve of 10 ms "
        "and more. Best of the repetitions; processor time is that of server and client together, and of the server "
        "alone.\n"
    )
    rows = []
    for name, ways in ways_of(runs, "overhead"):
        engine, service = best(ways["engine"]), best(ways["service"])
        work = least(ways["engine"], "processor_ms")
        rows.append(
            [
                name,
                time_text(engine),
                time_text(best(ways["local"])),
                time_text(service),
                f"{service / engine - 1:+.1%}",
                f"{least(ways['service'], 'processor_ms') / work - 1:+.1%}",
                f"{least(ways['service'], 'server_ms') / work - 1:+.1%}",
                verdict(service <= engine * (1 + GOAL_OVERHEAD)),
            ]
        )
    head = ["solve", "engine", "in process, as messages", "service", "overhead", "in processor time", "of the server"]
    print(table([*head, "goal"], rows))


def report_iterates(runs):
    print(
        "Iterates with y at every time, watched over loopback: processor time of server and client together beyond "
        f"that of the engine. Goal: at most {GOAL_ITERATES:.0%}. Beside it the same job watched without y, and a bare "
        "gRPC stream of the same messages.\n"
    )
    rows = []
    for name, ways in ways_of(runs, "iterates"):
        engine = least(ways["engine"], "processor_ms")
        # A reader that misses iterates does less.
        complete = [run for run in ways["full"] if run["missed"] == 0] or ways["full"]
        full = least(complete, "processor_ms")
        rows.append(
            [
                name,
                f"{ways['full'][0]['iterates']:.0f}",
                bytes_text(ways["full"][0]["values_bytes"]),
                time_text(engine),
                f"{least(ways['job'], 'processor_ms') / engine - 1:+.1%}",
                f"{full / engine - 1:+.1%}",
                f"{least(complete, 'server_ms') / engine - 1:+.1%}",
                f"{least(ways['bare'], 'processor_ms') / engine:+.1%}",
                verdict(full <= engine * (1 + GOAL_ITERATES)),
            ]
        )
    head = ["solve", "iterates", "their y", "engine", "job without y", "job with y", "of the server", "bare gRPC"]
    print(table([*head, "goal"], rows))


def report_streams(runs):
    print(
        f"Streams, from the first message to the end. Goal: at least {GOAL_STREAM:.0%} of a bare gRPC stream of the "
        "same messages; "
        "where the engine makes them more slowly than that, of the engine.\n"
    )
    rows = []
    for name, ways in ways_of(runs, "stream"):
        rates = {way: max(run["messages_per_s"] for run in group) for way, group in ways.items()}
        volume = {way: max(run["bytes_per_s"] for run in group) for way, group in ways.items()}
        bound = min(rates["bare"], rates["engine"])
        rows.append(
            [
                name,
                f"{rates['engine']:.0f}",
                f"{rates['bare']:.0f}",
                f"{rates['service']:.0f}",
                f"{volume['bare'] / 1e9:.3f}",
                f"{volume['service'] / 1e9:.3f}",
                f"{rates['service'] / bound:.0%}",
                verdict(rates["service"] >= GOAL_STREAM * bound),
            ]
        )
    rates = ["engine, messages/s", "bare, messages/s", "service, messages/s", "bare, GB/s", "service, GB/s"]
    print(table(["stream", *rates, "of the bound", "goal"], rows))


def report_service(runs):
    report_overhead(runs)
    report_iterates(runs)
    report_streams(runs)


def cheapest(points, error):
    """The least time of (error, seconds) that meets `error`."""
    meeting = [time for reached, time in points if reached <= error]
    return min(meeting) if meeting else None


def extrapolated(points, error):
    """What `error` would take if the last points went on: error ~ time^-p with p measured over their last decade."""
    points = sorted((time, reached) for reached, time in points if reached > 0)
    order = -exponent(points)
    time, reached = min(points, key=lambda point: point[1])
    return time * (reached / error) ** (1 / order) if order > 0.1 else None


def report_work_precision(runs):
    print(
        "The least processor time, on one thread, of a run whose true error is below the one given (of each "
        "component of x, relative "
        "to its largest value), and in brackets how many times implicit Euler takes: `~` where that was extrapolated "
        "by its measured "
        "order. `–`: not reached with the steps allowed. Errors near the uncertainty of the reference are left out. "
        "Goals, for up to "
        f"{SMALL} states: "
        + ", ".join(f"{ratio} times at 1e-{digits}" for digits, ratio in GOAL_RATIOS.items())
        + ".\n"
    )
    problems = {}
    for run in runs:
        problem, way, _ = run["name"].split("|")
        problems.setdefault(problem, {}).setdefault(way, []).append(run)
    for problem, ways in problems.items():
        any_run = next(iter(ways.values()))[0]
        uncertainty = any_run["uncertainty"]
        points = {way: [(run["error"], seconds(run, "cpu_time")) for run in members] for way, members in ways.items()}
        euler = points.pop("implicit Euler", [])
        rows = []
        for digits in range(2, 11):
            error = 10.0**-digits
            if error < 3 * uncertainty:
                continue
            measured = cheapest(euler, error)
            reference = measured if measured is not None else extrapolated(euler, error) if euler else None
            row = [f"1e-{digits}", ("" if measured is not None else "~ ") + time_text(reference) if reference else "–"]
            ratios = []
            for way in points:
                time = cheapest(points[way], error)
                if time is not None and reference:
                    ratios.append(reference / time)
                row.append(
                    "–" if time is None else f"{time_text(time)}" + (f" ({reference / time:.3g}×)" if reference else "")
                )
            goal = GOAL_RATIOS.get(digits) if any_run["states"] <= SMALL else None
            row.append("" if goal is None else f"{goal}×: {verdict(bool(ratios) and max(ratios) >= goal)}")
            rows.append(row)
        print(f"### {problem}\n\n{any_run['states']:.0f} states; the reference is certain to {uncertainty:.1g}.\n")
        print(table(["error", "implicit Euler", *points, "goal"], rows))


def report_choice(runs):
    print(
        "Each method is asked for the same error (`--tolerance`), and its true error is checked; processor time on one"
        f" thread, best of the runs. Goal: the automatic choice takes at most {GOAL_CHOICE} times as long as the best"
        " explicit one. Where both are the same method, the ratio is noise. Methods that take long are left out at the"
        " smaller errors. With 100 steps only methods of second order are compared.\n"
    )
    settings = {}
    for run in runs:
        system, way, digits = re.split("/min_time|/iterations", run["name"])[0].split("|")
        settings.setdefault((system, int(digits)), {})[way] = run
    rows = []
    for (system, digits), ways in settings.items():
        chosen = ways.pop("auto", None)
        if not chosen or not ways:
            continue
        way, quickest = min(ways.items(), key=lambda item: item[1]["best_ms"])
        ratio = chosen["best_ms"] / quickest["best_ms"]
        rows.append(
            [
                system,
                f"1e-{digits}" if digits else "100 steps",
                chosen["label"],
                time_text(chosen["best_ms"] * 1e-3),
                way,
                time_text(quickest["best_ms"] * 1e-3),
                f"{ratio:.2f}",
                verdict(chosen["label"] == quickest["label"] or ratio <= GOAL_CHOICE),
            ]
        )
    print(table(["system", "error", "chosen", "time", "best explicit choice", "time", "ratio", "goal"], rows))


def report_threads(runs):
    print(
        "Wall-clock times, best of the repetitions; every answer has the bits of one thread. `independent sums` share"
        " nothing: their speed-up is what the machine had to give. `more work`: the processor time of all threads over"
        " that of one. `waiting`: the part of the threads' time in which they have no processor or nothing to do, the"
        " paper's communication.\n\n**Model, not measured**: the serial fraction is what one thread spends outside"
        " parallel loops, measured in processor time; on p processors a loop of b blocks takes ⌈b/p⌉/b of its time, and"
        " threads cost nothing.\n"
    )
    rows = []
    for (work,), members in grouped(runs, 1).items():
        times = {}
        for run in members:
            times.setdefault(int(run["threads"]), []).append(run)
        if 1 not in times:
            continue
        one, most = best(times[1]), max(times)
        quickest, parallel = (min(times[threads], key=seconds) for threads in (1, most))
        busy = seconds(parallel, "cpu_time")
        rows.append(
            [
                work,
                time_text(one),
                *(f"{quickest[part] / one:.0%}" for part in ("seconds_lcp", "seconds_linear", "seconds_setup")),
                *(f"{one / best(times[p]):.2f}" for p in sorted(times) if p > 1),
                f"{busy / seconds(quickest, 'cpu_time') - 1:+.0%}",
                f"{max(0, 1 - busy / (most * seconds(parallel))):.0%}",
                f"{quickest['serial_fraction']:.1%}",
                *(f"{quickest[f'model_{p}']:.1f}" for p in MODELED),
            ]
        )
    threads = sorted({int(run["threads"]) for run in runs} - {1})
    print(
        table(
            [
                "solve",
                "one thread",
                "LCPs",
                "convolutions and states",
                "kernel",
                *(f"speed-up, {p} threads" for p in threads),
                "more work",
                "waiting",
                "serial fraction",
                *(f"model, {p}" for p in MODELED),
            ],
            rows,
        )
    )


STANDARD = {
    "name",
    "family_index",
    "per_family_instance_index",
    "run_name",
    "run_type",
    "repetitions",
    "repetition_index",
    "threads",
    "iterations",
    "real_time",
    "cpu_time",
    "time_unit",
    "label",
}


def report_plain(runs):
    counters = list(dict.fromkeys(key for run in runs for key in run if key not in STANDARD))
    rows = [
        [
            run["name"].split("/min_time")[0],
            time_text(seconds(run)),
            time_text(seconds(run, "cpu_time")),
            *(f"{run[key]:.3g}" if key in run else "" for key in counters),
        ]
        for run in runs
    ]
    print(table(["benchmark", "time", "processor time", *counters], rows))


def report_lcps(runs):
    report_lcp(runs)
    print("All of them:\n")
    report_plain(runs)


def report_periodic(runs):
    rows = []
    for run in runs:
        verdict = "met" if run["ratio"] >= run["goal"] and run["integrated"] <= 12 else "**missed**"
        rows.append(
            [
                run["name"].split("/")[1],
                f"{run['integrated']:.0f}",
                f"{run['steady_ms']:.3g} ms",
                f"{run['transient_ms']:.3g} ms",
                f"{run['ratio']:.3g}",
                f"{run['goal']:.3g}: {verdict}",
                f"{run['difference']:.1g}",
            ]
        )
    print(
        table(
            ["periods N", "integrated", "steady state", "transient", "ratio", "goal N/25, at most 12", "apart"], rows
        )
    )


# In the order of the report; a program that is not named here gets a plain table at the end.
CHAPTERS = {
    "work_precision_bench": ("Work and precision", report_work_precision),
    "choice_bench": ("The automatic choice", report_choice),
    "events_bench": ("Event location", report_plain),
    "periodic_bench": ("Periodic steady states", report_periodic),
    "lcp_bench": ("Linear complementarity problems", report_lcps),
    "signorini_bench": ("The Signorini problem", report_signorini),
    "growth_bench": ("Growth with steps, pairs and states", report_growth),
    "threads_bench": ("Threads", report_threads),
    "service_bench": ("What the service costs", report_service),
}


def chapter_of(path, failures):
    """The text of a program's chapter; what failed its check goes to `failures`."""
    name = path.stem
    title, report = CHAPTERS.get(name, (name, report_plain))
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        print(f"## {title}\n\n`{name}`\n")
        try:
            runs = [run for run in json.loads(path.read_text())["benchmarks"] if run.get("run_type") != "aggregate"]
        except json.JSONDecodeError:
            failures.append((name, "the program did not end well"))
            return title, text.getvalue()
        failures += [
            (f"{name}: {run['name']}", run["error_message"])
            for run in runs
            if run.get("error_occurred") and run["error_message"] != NOT_NEEDED
        ]
        good = [run for run in runs if not run.get("error_occurred")]
        if good:
            report(good)
    return title, text.getvalue()


def main(folder):
    files = {path.stem: path for path in sorted(folder.glob("*.json"))}
    failures = []
    names = [*(name for name in CHAPTERS if name in files), *(name for name in files if name not in CHAPTERS)]
    chapters = [chapter_of(files[name], failures) for name in names]
    print((folder / "machine.md").read_text())
    goals = [
        [title, str(len(re.findall(r"(?<!\w)met\b", text))), str(text.count("**missed**"))] for title, text in chapters
    ]
    print("## Goals\n\n" + table(["chapter", "met", "missed"], [row for row in goals if row[1:] != ["0", "0"]]))
    print("\n".join(text for _, text in chapters))
    print("## Answers that failed their check\n")
    print("\n".join(f"- `{name}`: {why}" for name, why in failures) or "None.")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
