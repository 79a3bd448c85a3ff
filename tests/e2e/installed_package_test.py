#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Installs dlcs into a folder of its own and builds the programs of installed_package/ against it, as a user does.

The system x' = y - 1, 0 <= y ⟂ x + y >= 0, x(0) = 1 slides down to 0 at t = 1 and then follows x' = -x - 1:
x(2) = exp(-1) - 1. Usage: installed_package_test.py CMAKE BUILD_FOLDER CXX
"""

import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

CMAKE, BUILD, CXX = sys.argv[1:4]
SOURCES = pathlib.Path(__file__).parent / "installed_package"
SCRATCH = tempfile.TemporaryDirectory()
ROOT = pathlib.Path(SCRATCH.name)


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert done.returncode == 0, f"{command} ended with {done.returncode}:\n{done.stdout}{done.stderr}"
    return done.stdout


def install(name, *components):
    """Installs to a folder that is then moved, since the package must work at any place."""
    for component in components:
        run(CMAKE, "--install", BUILD, "--prefix", ROOT / "first", "--component", component)
    return (ROOT / "first").rename(ROOT / name)


def configure(prefix, program, *options):
    folder = ROOT / f"{program}-of-{prefix.name}"
    command = [
        CMAKE,
        "-S",
        SOURCES,
        "-B",
        folder,
        "-G",
        "Ninja",
        f"-DCMAKE_PREFIX_PATH={prefix}",
        f"-DPROGRAM={program}",
        f"-DCMAKE_CXX_COMPILER={CXX}",
        *options,
    ]
    return folder, subprocess.run([str(word) for word in command], capture_output=True, text=True)


def build(prefix, program, *options):
    folder, configured = configure(prefix, program, *options)
    assert configured.returncode == 0, configured.stdout + configured.stderr
    run(CMAKE, "--build", folder)
    return folder / program


class InstalledPackage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.engine = install("engine", "core")
        cls.everything = install("everything", "core", "client", "programs")

    def test_engine_needs_no_grpc(self):
        program = build(
            self.engine,
            "solve_here",
            "-DCMAKE_DISABLE_FIND_PACKAGE_gRPC=ON",
            "-DCMAKE_DISABLE_FIND_PACKAGE_Protobuf=ON",
        )
        self.assertAlmostEqual(float(run(program)), math.exp(-1) - 1, delta=1e-6)
        libraries = run("ldd", program)
        self.assertIn("libtbb", libraries)
        self.assertNotIn("grpc", libraries)
        self.assertNotIn("protobuf", libraries)

    def test_programs_start_without_shared_libraries_of_grpc(self):
        if "DLCS_STATIC_LIBRARIES:BOOL=ON" not in (pathlib.Path(BUILD) / "CMakeCache.txt").read_text():
            self.skipTest("built with shared libraries")
        for program in ("dlcs", "dlcsd"):
            libraries = run("ldd", self.everything / "bin" / program)
            self.assertNotIn("libgrpc", libraries)
            self.assertNotIn("libabsl", libraries)

    def test_missing_component_is_named(self):
        _, configured = configure(self.engine, "solve_there")
        self.assertNotEqual(configured.returncode, 0)
        self.assertIn("component client is not installed", " ".join(configured.stderr.split()))

    def test_client_gets_the_bits_of_the_engine(self):
        here = build(self.everything, "solve_here")
        there = build(self.everything, "solve_there")
        server = subprocess.Popen(
            [self.everything / "bin" / "dlcsd", "--listen", "127.0.0.1:0", "--log-level", "off"],
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            address = server.stdout.readline().removeprefix("dlcsd listening on ").strip()
            self.assertEqual(run(there, address), run(here))
        finally:
            server.terminate()
            server.wait(timeout=30)
            server.stdout.close()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
