#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""deploy/kubernetes and deploy/compose.yaml have settings that dlcsd accepts and that fit together.

Usage: manifests_test.py DLCSD DLCS DEPLOY_FOLDER
"""

import contextlib
import pathlib
import re
import subprocess
import sys
import unittest

import yaml

DLCSD = sys.argv[1]
DLCS = sys.argv[2]
DEPLOY = pathlib.Path(sys.argv[3])
FLAG = re.compile(r"--[a-z][a-z-]*")


def read_all(path):
    with open(path) as file:
        return [document for document in yaml.safe_load_all(file) if document]


def known_flags():
    done = subprocess.run([DLCSD, "--help"], capture_output=True, text=True, check=True)
    return set(FLAG.findall(done.stdout))


def is_within(selector, labels):
    return selector.items() <= labels.items()


@contextlib.contextmanager
def server(role):
    """The address of a dlcsd in this role, which waits for a database."""
    store = "postgresql://nobody@localhost:1/nothing"
    process = subprocess.Popen(
        [DLCSD, "--listen", "127.0.0.1:0", "--role", role, "--store", store, "--log-level", "off"],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield process.stdout.readline().removeprefix("dlcsd listening on ").strip()
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def health(address, service):
    done = subprocess.run([DLCS, "health", "--server", address, "--service", service], capture_output=True, text=True)
    return done.stdout.strip()


def workers(*arguments):
    done = subprocess.run([DLCS, "workers", *arguments], capture_output=True, text=True, check=True)
    return done.stdout


class ComposeTest(unittest.TestCase):
    def setUp(self):
        [self.file] = read_all(DEPLOY / "compose.yaml")
        self.ours = {name: service for name, service in self.file["services"].items() if service["image"] == "dlcs"}

    def test_gives_flags_that_dlcsd_knows(self):
        self.assertEqual(set(self.ours), {"front", "worker"})
        for service in self.ours.values():
            flags = {word for word in service["command"] if word.startswith("--")}
            self.assertLessEqual(flags, known_flags())

    def test_contains_our_services(self):
        for service in self.ours.values():
            self.assertTrue(service["read_only"])
            self.assertEqual(service["cap_drop"], ["ALL"])

    def test_listens_on_this_machine_alone(self):
        for service in self.file["services"].values():
            for port in service.get("ports", []):
                self.assertTrue(port.startswith("127.0.0.1:"), port)


class KubernetesTest(unittest.TestCase):
    def setUp(self):
        folder = DEPLOY / "kubernetes"
        [self.kustomization] = read_all(folder / "kustomization.yaml")
        self.all = [document for name in self.kustomization["resources"] for document in read_all(folder / name)]
        self.common = {key: value for one in self.kustomization["labels"] for key, value in one["pairs"].items()}

    def of(self, kind):
        return {one["metadata"]["name"]: one for one in self.all if one["kind"] == kind}

    def labels_of_pods(self):
        return [
            {**one["spec"]["template"]["metadata"]["labels"], **self.common} for one in self.of("Deployment").values()
        ]

    def containers(self):
        for deployment in self.of("Deployment").values():
            pod = deployment["spec"]["template"]["spec"]
            for container in pod["containers"]:
                yield pod, container

    def test_names_every_file(self):
        here = {path.name for path in (DEPLOY / "kubernetes").glob("*.yaml")} - {"kustomization.yaml"}
        self.assertEqual(set(self.kustomization["resources"]), here)

    def test_gives_flags_that_dlcsd_knows(self):
        for _, container in self.containers():
            flags = {word for word in container["args"] if word.startswith("--")}
            self.assertLessEqual(flags, known_flags())

    def test_has_the_workers_of_our_command(self):
        self.assertEqual(workers("kubernetes"), (DEPLOY / "kubernetes" / "worker.yaml").read_text())

    def test_contains_its_programs(self):
        for pod, container in self.containers():
            self.assertTrue(pod["securityContext"]["runAsNonRoot"])
            self.assertEqual(pod["securityContext"]["seccompProfile"], {"type": "RuntimeDefault"})
            self.assertFalse(pod["automountServiceAccountToken"])
            self.assertTrue(container["securityContext"]["readOnlyRootFilesystem"])
            self.assertFalse(container["securityContext"]["allowPrivilegeEscalation"])
            self.assertEqual(container["securityContext"]["capabilities"], {"drop": ["ALL"]})
            self.assertIn("memory", container["resources"]["limits"])

    def test_probes_ports_that_are_there(self):
        for _, container in self.containers():
            ports = {port["containerPort"] for port in container["ports"]}
            probes = [probe for key, probe in container.items() if key.endswith("Probe")]
            self.assertGreaterEqual(len(probes), 2)
            for probe in probes:
                self.assertIn(probe["grpc"]["port"], ports)

    def test_probes_services_that_the_role_answers_for(self):
        for _, container in self.containers():
            with server(container["args"][container["args"].index("--role") + 1]) as address:
                for kind in ("startupProbe", "livenessProbe"):
                    # Also without a database: a server that waits for one must not be killed.
                    self.assertEqual(health(address, container[kind]["grpc"].get("service", "")), "SERVING")
                self.assertEqual(health(address, container["readinessProbe"]["grpc"]["service"]), "NOT_SERVING")

    def test_selects_pods_that_are_there(self):
        for deployment in self.of("Deployment").values():
            self.assertTrue(
                is_within(
                    deployment["spec"]["selector"]["matchLabels"], deployment["spec"]["template"]["metadata"]["labels"]
                )
            )
        selectors = [one["spec"]["selector"] for one in self.of("Service").values()]
        selectors += [one["spec"]["selector"]["matchLabels"] for one in self.of("PodDisruptionBudget").values()]
        selectors += [one["spec"]["podSelector"]["matchLabels"] for one in self.of("NetworkPolicy").values()]
        for selector in selectors:
            self.assertTrue(any(is_within(selector, labels) for labels in self.labels_of_pods()), selector)

    def test_lets_traffic_to_ports_that_are_there(self):
        ports = {port["containerPort"] for _, container in self.containers() for port in container["ports"]}
        for policy in self.of("NetworkPolicy").values():
            for rule in policy["spec"].get("ingress", []):
                for port in rule["ports"]:
                    self.assertIn(port["port"], ports)

    def test_scales_a_deployment_that_does_not_say_how_many(self):
        for scaler in self.of("HorizontalPodAutoscaler").values():
            scaled = self.of("Deployment")[scaler["spec"]["scaleTargetRef"]["name"]]
            self.assertNotIn("replicas", scaled["spec"])


class WorkersTest(unittest.TestCase):
    """What `dlcs workers` writes with other options than those of deploy/kubernetes."""

    def test_a_job_ends_with_its_workers(self):
        [job] = yaml.safe_load_all(
            workers("kubernetes", "--exit-when-idle", "5m", "--count", "7", "--time-limit", "12h", "--cpus", "2")
        )
        self.assertEqual((job["apiVersion"], job["kind"]), ("batch/v1", "Job"))
        self.assertEqual(job["spec"]["parallelism"], 7)
        self.assertNotIn("completions", job["spec"])
        self.assertEqual(job["spec"]["activeDeadlineSeconds"], 12 * 3600)
        pod = job["spec"]["template"]["spec"]
        self.assertEqual(pod["restartPolicy"], "OnFailure")
        [container] = pod["containers"]
        arguments = container["args"]
        self.assertEqual(arguments[arguments.index("--exit-when-idle") + 1], "300")
        self.assertEqual(arguments[arguments.index("--threads") + 1], "2")
        self.assertEqual(container["resources"]["requests"]["cpu"], "2")
        checked = [DLCSD, "--check-config", *[word for word in arguments]]
        self.assertIn("exit-when-idle = 300", subprocess.run(checked, capture_output=True, text=True).stdout)

    def test_a_fixed_number_has_no_autoscaler(self):
        deployment, budget = yaml.safe_load_all(workers("kubernetes", "--count", "5", "--most", "5"))
        self.assertEqual(deployment["spec"]["replicas"], 5)
        self.assertEqual(budget["kind"], "PodDisruptionBudget")

    def test_refuses_what_would_not_work(self):
        store = ["--store", "postgresql://dlcs@db/dlcs"]
        for arguments, text in [
            (["slurm"], "--store"),
            (["slurm", "--store", "jobs.db"], "postgresql://"),
            (["slurm", "--store", "postgresql://dlcs:secret@db/dlcs"], "password"),
            (["slurm", "--store", "postgresql://db/dlcs?password=secret"], "password"),
            (["slurm", *store, "--count", "0"], "between 1 and 10000"),
            (["slurm", *store, "--time-limit", "12 parsecs"], "unit"),
            (["slurm", *store, "--partition", "a; rm -r /"], "--partition"),
            (["kubernetes", "--time-limit", "1h"], "--exit-when-idle"),
            (["kubernetes", "--image", "a\nb"], "--image"),
            (["kubernetes", "--memory", "1kB"], "100MB"),
        ]:
            done = subprocess.run([DLCS, "workers", *arguments], capture_output=True, text=True)
            self.assertEqual(done.returncode, 2, arguments)
            self.assertIn(text, done.stderr)
            self.assertNotIn("secret", done.stderr)

    def test_a_script_of_slurm_starts_a_worker(self):
        """Runs the script with a shell in place of sbatch. --check-config prints the settings."""
        store = "postgresql://dlcs@db/it's?sslmode=require"
        script = workers("slurm", "--store", store, "--cpus", "3", "--time-limit", "90m", "--memory", "2GB",
                         "--partition", "long", "--program", DLCSD)
        self.assertEqual(script.splitlines()[0], "#!/bin/bash")
        given = dict(line.removeprefix("#SBATCH --").partition("=")[::2]
                     for line in script.splitlines() if line.startswith("#SBATCH"))
        self.assertEqual(given["time"], "0-01:30:00")
        self.assertEqual(given["mem"], "1908M")  # of 1024 * 1024 bytes
        self.assertEqual(given["partition"], "long")
        done = subprocess.run(["bash", "-c", script.rstrip() + " --check-config\n"], capture_output=True, text=True,
                              env={"SLURM_ARRAY_JOB_ID": "17", "SLURM_ARRAY_TASK_ID": "3"})
        self.assertEqual(done.returncode, 0, done.stderr)
        settings = {key: value.strip().strip('"') for key, _, value in
                    (line.split("#")[0].partition(" = ") for line in done.stdout.splitlines())}
        self.assertEqual(settings["role"], "worker")
        self.assertEqual(settings["store"], store)
        self.assertEqual(settings["threads"], "3")
        self.assertEqual(settings["worker-name"], "slurm-17-3")
        self.assertEqual(settings["exit-when-idle"], "60")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
