# SPDX-License-Identifier: Apache-2.0
"""Machines of a network, in namespaces of this one: each has an address, and can be cut off."""

import os
import subprocess
import sys

INSIDE = "DLCS_FLEET_INSIDE"
SKIPPED = 77


def enter_namespaces():
    """Runs this program again in namespaces of its own, with which everything that it starts ends. Exits with 77 where
    there can be none."""
    if os.environ.get(INSIDE):
        return
    unshare = ["unshare", "--net", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc"]
    bridge = "mkdir -p /run/netns && ip link add one type bridge"
    if os.geteuid() != 0:
        print("skipped: needs root, for network namespaces")
        sys.exit(SKIPPED)
    if subprocess.run([*unshare, "sh", "-c", bridge], capture_output=True).returncode != 0:
        print("skipped: no network namespaces with a bridge here")
        sys.exit(SKIPPED)
    os.environ[INSIDE] = "yes"
    os.execvp("unshare", [*unshare, sys.executable, *sys.argv])


def run(*command):
    return subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True).stdout


class Network:
    """The machine of the test itself is 10.78.0.1."""

    def __init__(self):
        run("mkdir", "-p", "/run/netns")
        run("mount", "-t", "tmpfs", "none", "/run/netns")
        run("ip", "link", "set", "lo", "up")
        run("ip", "link", "add", "hub", "type", "bridge")
        run("ip", "address", "add", "10.78.0.1/24", "dev", "hub")
        run("ip", "link", "set", "hub", "up")
        self.machines = 1

    def machine(self, name):
        self.machines += 1
        return Machine(name, f"10.78.0.{self.machines}")


class Machine:
    def __init__(self, name, address):
        self.name = name
        self.address = address
        run("ip", "netns", "add", name)
        run("ip", "link", "add", f"to-{name}", "type", "veth", "peer", "name", "eth0", "netns", name)
        run("ip", "link", "set", f"to-{name}", "master", "hub", "up")
        run(*self.command("ip", "link", "set", "lo", "up"))
        run(*self.command("ip", "address", "add", f"{address}/24", "dev", "eth0"))
        run(*self.command("ip", "link", "set", "eth0", "up"))

    def command(self, *command):
        """Runs on this machine, and has the process id of what it starts."""
        return ["nsenter", f"--net=/run/netns/{self.name}", *command]

    def cut(self, *others):
        """What this machine sends to them vanishes: no answer, and no refusal either."""
        for other in others:
            run(*self.command("ip", "route", "replace", "blackhole", f"{other.address}/32"))

    def mend(self, *others):
        for other in others:
            run(*self.command("ip", "route", "delete", "blackhole", f"{other.address}/32"))

    def unplug(self):
        run("ip", "link", "set", f"to-{self.name}", "down")

    def plug(self):
        run("ip", "link", "set", f"to-{self.name}", "up")

    def slow(self, rate="200kbit"):
        run(*self.command("tc", "qdisc", "add", "dev", "eth0", "root", "tbf", "rate", rate, "burst", "16kb"),
            "latency", "400ms")

    def unslow(self):
        run(*self.command("tc", "qdisc", "delete", "dev", "eth0", "root"))
