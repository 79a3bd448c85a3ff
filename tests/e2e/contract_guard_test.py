#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""deploy/check-proto.sh accepts the contract as it is, and nothing that would break a program of a user.

Usage: contract_guard_test.py SOURCE_FOLDER. Exit code 77 where buf cannot be had: nothing was tested then.
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(sys.argv[1])
NOT_HERE = 77


def check(*folder):
    done = subprocess.run([SOURCE / "deploy/check-proto.sh", *folder], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


class ContractGuardTest(unittest.TestCase):
    def refused(self, file, old, new):
        """The result of the guard for the contract with `old` replaced by `new`."""
        with tempfile.TemporaryDirectory() as folder:
            changed = pathlib.Path(folder) / "proto"
            shutil.copytree(SOURCE / "proto", changed)
            path = changed / "dlcs/v1" / file
            text = path.read_text()
            self.assertIn(old, text)
            path.write_text(text.replace(old, new, 1))
            code, said = check(changed)
            self.assertEqual(code, 1, said)
            return said

    def test_accepts_the_contract_as_it_is(self):
        code, said = check()
        self.assertEqual((code, said), (0, ""))

    def test_refuses_a_field_that_is_gone(self):
        said = self.refused("solver.proto", "  double horizon = 8;", "  reserved 8;")
        self.assertIn('"horizon" on message "Problem"', said)
        self.assertIn("breaks programs written for the release", said)

    def test_refuses_a_number_that_means_something_else(self):
        self.assertIn("changed type", self.refused("solver.proto", "int32 steps = 2;", "string steps = 2;"))

    def test_refuses_a_method_that_is_gone(self):
        old = "  rpc CancelSolveJob(CancelSolveJobRequest) returns (SolveJob);"
        self.assertIn('RPC "CancelSolveJob"', self.refused("jobs.proto", old, ""))

    def test_refuses_a_method_without_a_word_about_it(self):
        old = "  // Returns the methods and limits of this server.\n"
        self.assertIn('RPC "GetCapabilities"', self.refused("solver.proto", old, ""))

    def test_refuses_a_new_value_without_its_prefix(self):
        said = self.refused("solver.proto", "  JOB_STATE_CANCELLED = 6;", "  JOB_STATE_CANCELLED = 6;\n  PAUSED = 7;")
        self.assertIn('"PAUSED" should be prefixed', said)


if __name__ == "__main__":
    code, said = check()
    if code == NOT_HERE:
        print(said)
        sys.exit(NOT_HERE)
    unittest.main(argv=sys.argv[:1])
