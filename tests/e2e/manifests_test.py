#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""deploy/kubernetes and deploy/compose.yaml say what dlcsd understands and what fits together.

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
                    # Without a database too: nothing kills a server that waits for one.
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


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
