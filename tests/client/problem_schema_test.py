# SPDX-License-Identifier: Apache-2.0
"""The schema of problem files: every case passes it, and files that the reader refuses do not.

    problem_schema_test.py SCHEMA CASES_FOLDER
"""

import copy
import json
import pathlib
import sys
import unittest

import jsonschema

SCHEMA_FILE, CASES = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
SCHEMA = json.loads(SCHEMA_FILE.read_text())
EXAMPLE = {"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [1], "T": 1}


def passes(problem):
    return jsonschema.Draft7Validator(SCHEMA).is_valid(problem)


class ProblemSchemaTest(unittest.TestCase):
    def test_is_a_schema(self):
        jsonschema.Draft7Validator.check_schema(SCHEMA)

    def test_every_case_passes(self):
        cases = sorted(CASES.glob("*.json"))
        self.assertGreaterEqual(len(cases), 17)
        for case in cases:
            with self.subTest(case=case.name):
                jsonschema.validate(json.loads(case.read_text()), SCHEMA)

    def test_forms_of_sources_pass(self):
        for source in (["t", 1], {"times": [0, 1], "values": [[1], [2]]},
                       {"breaks": [0, 1], "coefficients": [[[1], [2]]]}):
            with self.subTest(source=source):
                self.assertTrue(passes({**EXAMPLE, "f": source}))
                self.assertTrue(passes({**EXAMPLE, "pieces": [{"t0": 0, "g": source}]}))

    def test_every_required_key_is_required(self):
        for key in EXAMPLE:
            with self.subTest(key=key):
                problem = copy.deepcopy(EXAMPLE)
                del problem[key]
                self.assertFalse(passes(problem))

    def test_mistakes_do_not_pass(self):
        for key, value in (("A", [1]), ("A", []), ("N", [["x"]]), ("x0", 1), ("T", "1"), ("T", 0), ("f", "t"),
                           ("g", [[1]]), ("f", {"times": [0]}), ("pieces", []), ("pieces", [{"f": [1]}]),
                           ("rule", "least"), ("breakpoints", [1]), ("name", 7)):
            with self.subTest(key=key, value=value):
                self.assertFalse(passes({**EXAMPLE, key: value}))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
