#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A day of many jobs on several databases, from the costs that store_load measured.

    store_plan.py [OPTIONS]             a day, for several numbers of databases ("stores")
    store_plan.py --closed [OPTIONS]    the set-up of store_load: workers without work on one database

The day, second by second: jobs arrive at random, three times as many as on average at the peak; users belong to stores
by a hash, and some have far more jobs than others; each store has its share of the workers. A second of a store's
processors goes to the lists that servers read (once a second each, and longer with a longer queue), to notifications
of new jobs (at most 50 a second by each front, and each is heard by each server of the store), and to the lives of
jobs. At the peak the store with most jobs fails for some minutes: nothing of it starts or ends, and what arrives waits.

The set-up of store_load is simulated by events: each operation takes processor time, in order of arrival, and then
waits for a flush of the disk, which any number share.
"""

import argparse
import heapq
import math
import random

import numpy as np

DAY = 86400


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--closed", action="store_true")
    add("--stores", type=int, nargs="+", default=[1, 4, 16, 32, 64])
    add("--jobs", type=float, default=1e8, help="a day")
    add("--workers", type=int, default=None, help="cores that run jobs (10,000); threads with --closed (16)")
    add("--server-cores", type=int, default=1, help="of these in one dlcsd, which has one list and one listener")
    add("--job-s", type=float, default=2, help="time of a job on a core, without the store")
    add("--users", type=int, default=10000)
    add("--skew", type=float, default=0.5, help="user number k has jobs in proportion to k^-SKEW")
    add("--processors", type=float, default=16, help="of a store")
    add("--busiest", type=float, default=0.7, help="share of them that may be used")
    add("--down-s", type=int, default=600, help="the failure of a store")
    add("--limit", type=int, default=1000, help="of a list")
    add("--poll-s", type=float, default=1, help="between lists of a server")
    add("--fronts", type=int, default=2, help="of a store")
    # Measured: milliseconds of a processor.
    add("--life-ms", type=float, default=LIFE_MS, help="the database's, for the whole life of a job")
    add("--list-ms", type=float, default=LIST_MS, help="a list of no jobs")
    add("--listed-ms", type=float, default=LISTED_MS, help="each job in a list")
    add("--notice-ms", type=float, default=NOTICE_MS, help="a notification, for each server that hears it")
    add("--worker-ms", type=float, default=WORKER_MS, help="the worker's calls of the store, with --closed")
    add("--flush-ms", type=float, default=FLUSH_MS, help="of the disk, with --closed")
    return parser.parse_args()


COMMITS = 6  # of a job of store_load: create, claim, renew, two windows, finish
NOTICES_PER_S = 50  # of a server (postgres_announcer.cc)


def closed(a, seconds=100.0):
    """Jobs per second of `a.workers` threads on `a.processors`; a part of a processor is a slow one."""
    rng = random.Random(1)
    count = max(1, math.ceil(a.processors))
    burst = 1e-3 * count / a.processors * (a.life_ms + a.worker_ms) / COMMITS
    free = [0.0] * count  # when each processor is free
    waiting, flushing = [], []
    done = 0  # commits
    events = [(0.0, k, "ready") for k in range(a.workers)]
    while events:
        now, worker, what = heapq.heappop(events)
        if now > seconds:
            break
        if what == "ready":  # takes the next free processor
            end = max(heapq.heappop(free), now) + rng.expovariate(1 / burst)
            heapq.heappush(free, end)
            heapq.heappush(events, (end, worker, "commit"))
            continue
        if what == "commit":
            waiting.append(worker)
        else:
            done += len(flushing)
            for one in flushing:
                heapq.heappush(events, (now, one, "ready"))
            flushing = []
        if not flushing and waiting:
            flushing, waiting = waiting, []
            heapq.heappush(events, (now + 1e-3 * a.flush_ms, -1, "flushed"))
    return done / COMMITS / seconds


def shape(second):
    """Arrivals relative to their mean: half at night, three times at 14:00."""
    hours = second / 3600
    return 0.5 + 2.5 * np.exp(-(((hours - 14) / 2.708) ** 2))


def shares(a, stores):
    """Of the jobs, by store."""
    rng = np.random.default_rng(7)
    weight = (1 + np.arange(a.users)) ** -a.skew
    return np.bincount(rng.integers(stores, size=a.users), weight / weight.sum(), minlength=stores)


def percentile(values, weights, percent):
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return values[order][np.searchsorted(total, percent / 100 * total[-1])]


def day(a, stores):
    rng = np.random.default_rng(1)
    share = shares(a, stores)
    workers = np.full(stores, a.workers // stores)
    servers = workers / a.server_cores
    queue, busy = np.zeros(stores, int), np.zeros(stores, int)
    ends = min(1 / a.job_s, 1)
    budget = 1e3 * a.processors * a.busiest  # ms in a second
    failed = int(np.argmax(share))
    fails, back = 14 * 3600, 14 * 3600 + a.down_s
    arrived, started = np.zeros((DAY, stores)), np.zeros((DAY, stores))
    used, overhead, idle = np.zeros((DAY, stores)), np.zeros((DAY, stores)), np.zeros(DAY)
    for t in range(DAY):
        new = rng.poisson(a.jobs / DAY * shape(t) * share)
        queue = queue + new
        lists = servers / a.poll_s * (a.list_ms + a.listed_ms * np.minimum(queue, a.limit))
        told = np.minimum(new, NOTICES_PER_S * a.fronts) * a.notice_ms * servers
        done = rng.binomial(busy, ends)
        room = np.minimum(queue, workers - busy + done)
        starts = np.minimum(room, np.maximum(budget - lists - told, 0) / a.life_ms).astype(int)
        if fails <= t < back:
            starts[failed] = done[failed] = 0
        queue, busy = queue - starts, busy + starts - done
        arrived[t], started[t] = new, starts
        used[t] = lists + told + starts * a.life_ms
        overhead[t] = used[t] - starts * a.life_ms
        idle[t] = a.workers - busy.sum()
    return summary(a, share, failed, queue, arrived, started, used, overhead, idle)


def summary(a, share, failed, queue, arrived, started, used, overhead, idle):
    waits = []
    for p in range(len(share)):
        begun = np.cumsum(started[:, p])
        last = np.cumsum(arrived[:, p])
        waits.append(np.searchsorted(begun, last) - np.arange(DAY))  # of the last job of each second; DAY: not begun
    wait = np.maximum(np.stack(waits, 1), 0)
    others = np.arange(len(share)) != failed
    use = used / (1e3 * a.processors)
    longest = np.where(arrived > 0, wait, 0).max(0)
    return {
        "largest": share.max() * len(share),
        "mean": use.mean(),
        "peak": use[14 * 3600 - 1800 : 14 * 3600].mean(0).max(),
        "overhead": overhead.sum() / used.sum(),
        "p50": percentile(wait.ravel(), arrived.ravel(), 50),
        "p99": percentile(wait.ravel(), arrived.ravel(), 99),
        "longest": longest[failed],
        "others": longest[others].max(initial=0),
        "idle": idle.mean() / a.workers,
        "left": queue.sum(),
    }


def main():
    a = arguments()
    if a.closed:
        a.workers = a.workers or 16
        print(f"{a.workers} workers on {a.processors} processors: {closed(a):.1f} jobs/s")
        return
    a.workers = a.workers or 10000
    print("stores  largest  use of processors  of it not  wait [s]           longest there  idle     left in")
    print("        /mean    mean  peak hottest   lives       p50    p99  it failed  others  workers  the queue")
    for stores in a.stores:
        s = day(a, stores)
        print(
            f"{stores:6} {s['largest']:8.2f} {s['mean']:6.0%} {s['peak']:13.0%} {s['overhead']:7.0%}"
            f" {s['p50']:9.0f} {s['p99']:6.0f} {s['longest']:10.0f} {s['others']:7.0f}"
            f" {s['idle']:8.0%} {s['left']:10,.0f}",
            flush=True,
        )


# As measured on two shared cores (README.md).
LIFE_MS, LIST_MS, LISTED_MS, NOTICE_MS, WORKER_MS, FLUSH_MS = 5, 0.5, 0.005, 0.024, 0.8, 2

if __name__ == "__main__":
    main()
