# SPDX-License-Identifier: Apache-2.0
"""The schemas of files: every case and example passes its own, and files that the reader refuses do not.

    problem_schema_test.py FOLDER_OF_SCHEMAS CASES_FOLDER EXAMPLES_FOLDER
"""

import copy
import json
import pathlib
import sys
import unittest

import jsonschema

SCHEMAS, CASES, EXAMPLES = (pathlib.Path(folder) for folder in sys.argv[1:4])
SCHEMA = json.loads((SCHEMAS / "problem.schema.json").read_text())
DCP = json.loads((SCHEMAS / "dcp.schema.json").read_text())
NONLINEAR = json.loads((SCHEMAS / "nonlinear.schema.json").read_text())
LCP = json.loads((SCHEMAS / "lcp.schema.json").read_text())
MEMBERS = json.loads((SCHEMAS / "members.schema.json").read_text())
EXAMPLE = {"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [1], "T": 1}


def validator(schema):
    """Schemas refer to each other by the names of their files."""
    return jsonschema.Draft7Validator(schema, resolver=jsonschema.RefResolver(SCHEMAS.resolve().as_uri() + "/", schema))


def passes(problem, schema=SCHEMA):
    return validator(schema).is_valid(problem)


def schema_of(content):
    """The schema of a file; None for files without one (paths, models)."""
    if content.get("kind") == "nonlinear":
        return NONLINEAR
    if "members" in content:
        return MEMBERS
    if "q" in content and "M" in content:
        return DCP
    return SCHEMA if "x0" in content else None


class ProblemSchemaTest(unittest.TestCase):
    def test_is_a_schema(self):
        for schema in (SCHEMA, DCP, NONLINEAR, LCP, MEMBERS):
            jsonschema.Draft7Validator.check_schema(schema)

    def test_every_example_passes(self):
        kinds = set()
        for example in sorted(EXAMPLES.glob("*.json")):
            content = json.loads(example.read_text())
            schema = schema_of(content)
            if schema is not None:
                kinds.add(schema["title"])
                with self.subTest(example=example.name):
                    validator(schema).validate(content)
        self.assertEqual(len(kinds), 4)

    def test_members_have_what_a_problem_has_in_time(self):
        for member in (
            {},
            {"x0": [1, 2]},
            {"x0": {"matrix_market": "x0.mtx"}},
            {"x0": {"file": "x0.npy"}},
            {"f": ["t"], "T": 2, "label": "late"},
            {"pieces": [{"t0": 0, "g": [1]}]},
            {"g": {"matrix": [[1]], "of": ["t"]}, "break_points": [0.5]},
        ):
            with self.subTest(member=member):
                self.assertTrue(passes([member], MEMBERS))
                self.assertTrue(passes({"members": [{}, member], "about": "two"}, MEMBERS))
        for member in (1, [1], {"A": [[1]]}, {"x0": 1}, {"T": 0}, {"label": 1}, {"rule": "unique"}):
            with self.subTest(member=member):
                self.assertFalse(passes([member], MEMBERS))
        self.assertFalse(passes([], MEMBERS))
        self.assertFalse(passes({"x0": [1]}, MEMBERS))

    def test_lcps_and_the_other_problems_take_every_form_of_a_matrix(self):
        nonlinear = {"kind": "nonlinear", "f": ["y1"], "g": ["y1"], "x0": [1], "T": 1}
        path = {"times": [0, 1], "values": [[0], [-1]]}
        for matrix in (
            [[1]],
            {"rows": 1, "columns": 1, "entries": [[0, 0, 2.5]]},
            {"rows": 1, "diagonals": {"0": 1}},
            {"matrix_market": "a.mtx"},
            {"file": "a.npz", "variable": "M"},
            {"kronecker_sum": [[[1]], [[2]]]},
        ):
            with self.subTest(matrix=matrix):
                self.assertTrue(passes({"M": matrix, "q": [1]}, LCP))
                self.assertTrue(passes({"M": matrix, "q": path}, DCP))
                self.assertTrue(passes({**nonlinear, "W": matrix}, NONLINEAR))
        for key, value in (("M", [1]), ("q", path), ("rule", "least"), ("selector", {"C": [[1]]}), ("T", 1)):
            with self.subTest(key=key, value=value):
                self.assertFalse(passes({"M": [[1]], "q": [1], key: value}, LCP))

    def test_every_file_may_name_its_schema(self):
        for schema, content in (
            (SCHEMA, EXAMPLE),
            (LCP, {"M": [[1]], "q": [1]}),
            (MEMBERS, {"members": [{}]}),
            (DCP, {"M": [[1]], "q": {"times": [0], "values": [[0]]}}),
            (NONLINEAR, {"kind": "nonlinear", "f": ["y1"], "g": ["y1"], "x0": [1], "T": 1}),
        ):
            with self.subTest(schema=schema["title"]):
                self.assertTrue(passes({**content, "$schema": "a.schema.json"}, schema))
                self.assertFalse(passes({**content, "$schema": 7}, schema))

    def test_mistakes_in_a_dcp_do_not_pass(self):
        example = {"M": [[1]], "q": {"times": [0, 1], "values": [[0], [-1]]}}
        self.assertTrue(passes(example, DCP))
        for key, value in (
            ("M", [1]),
            ("q", [0, 1]),
            ("q", {"times": [0, 1]}),
            ("q", {"times": [-1], "values": [[0]]}),
            ("T", 1),
        ):
            with self.subTest(key=key, value=value):
                self.assertFalse(passes({**example, key: value}, DCP))

    def test_mistakes_in_a_nonlinear_problem_do_not_pass(self):
        example = {"kind": "nonlinear", "f": ["y1"], "g": ["y1+x1"], "x0": [1], "T": 1}
        self.assertTrue(passes(example, NONLINEAR))
        self.assertFalse(passes(example))
        for key, value in (
            ("kind", "linear"),
            ("f", "y1"),
            ("f", []),
            ("g", [[1]]),
            ("T", 0),
            ("A", [[1]]),
            ("W", [1]),
        ):
            with self.subTest(key=key, value=value):
                self.assertFalse(passes({**example, key: value}, NONLINEAR))

    def test_every_case_passes(self):
        cases = sorted(CASES.glob("*.json"))
        self.assertGreaterEqual(len(cases), 17)
        for case in cases:
            with self.subTest(case=case.name):
                validator(SCHEMA).validate(json.loads(case.read_text()))

    def test_forms_of_sources_pass(self):
        for source in (
            ["t", 1],
            {"times": [0, 1], "values": [[1], [2]]},
            {"breaks": [0, 1], "coefficients": [[[1], [2]]]},
        ):
            with self.subTest(source=source):
                self.assertTrue(passes({**EXAMPLE, "f": source}))
                self.assertTrue(passes({**EXAMPLE, "rule": "minimizer", "selector": {"C": [[1]], "b": [0]}}))
                self.assertTrue(passes({**EXAMPLE, "pieces": [{"t0": 0, "g": source}]}))
                for key in ("f", "g"):
                    self.assertFalse(passes({**EXAMPLE, "pieces": [{"t0": 0, "g": source}], key: source}))
                    self.assertFalse(passes([{"pieces": [{"t0": 0, "g": source}], key: source}], MEMBERS))

    def test_forms_of_matrices_pass(self):
        entries = {"rows": 1, "columns": 1, "entries": [[0, 0, 2.5]]}
        lists = {"rows": 1, "columns": 1, "row_indices": [0], "column_indices": [0], "values": [2.5]}
        diagonals = {"rows": 3, "diagonals": {"0": 4, "1": [-1, -1], "-1": -1}}
        market = {"matrix_market": "a.mtx"}
        stored = {"file": "a.mat", "variable": "A"}
        self.assertTrue(passes({**EXAMPLE, "x0": stored}))
        for matrix in ([[1]], entries, lists, diagonals, market, stored, {"kronecker_sum": [[[1]], diagonals, stored]}):
            with self.subTest(matrix=matrix):
                self.assertTrue(passes({**EXAMPLE, "A": matrix, "x0": market}))
                self.assertTrue(passes({**EXAMPLE, "f": {"matrix": matrix, "of": ["t"]}}))
                self.assertTrue(passes({**EXAMPLE, "g": {"matrix": matrix, "pieces": [{"t0": 0, "of": [1]}]}}))

    def test_mistakes_in_matrices_do_not_pass(self):
        for matrix in (
            {},
            {"rows": 1, "entries": []},
            {"rows": 0, "columns": 1, "entries": []},
            {"rows": 1, "columns": 1, "entries": [[0, 0]]},
            {"rows": 1, "columns": 1, "entries": [[-1, 0, 1]]},
            {"rows": 1, "columns": 1, "entries": [[0.5, 0, 1]]},
            {"rows": 1, "columns": 1, "values": [1]},
            {"rows": 2, "diagonals": {"up": 1}},
            {"rows": 2, "diagonals": {"-0": 1}},
            {"kronecker_sum": []},
            {"kronecker_sum": [{"kronecker_sum": [[[1]]]}]},
            {"matrix_market": 1},
            {"file": 1},
            {"variable": "A"},
            {"file": "a.mat", "variable": 1},
            {"file": "a.mat", "matrix_market": "a.mtx"},
        ):
            with self.subTest(matrix=matrix):
                self.assertFalse(passes({**EXAMPLE, "A": matrix}))

    def test_names_parameters_and_formulas_in_matrices_pass(self):
        names = {"states": ["iL"], "pairs": ["D1"], "parameters": {"R": 2.5}}
        nonlinear = {"kind": "nonlinear", "f": ["iL*R"], "g": ["D1"], "x0": [1], "T": 1, "W": [["R"]]}
        for matrix in ([["-1/R"]], {"rows": 1, "columns": 1, "entries": [[0, 0, "R"]]}):
            with self.subTest(matrix=matrix):
                self.assertTrue(passes({**EXAMPLE, **names, "A": matrix}))
                self.assertFalse(passes({**EXAMPLE, "rule": "minimizer", "selector": {"C": matrix, "b": [0]}}))
                self.assertFalse(passes({"M": matrix, "q": [1]}, LCP))
        self.assertTrue(passes({**nonlinear, **names}, NONLINEAR))
        self.assertTrue(passes([{"parameters": {"R": 1}}], MEMBERS))
        for key, value in (
            ("states", "iL"),
            ("states", ["1x"]),
            ("pairs", ["D 1"]),
            ("pairs", ["a", "a"]),
            ("parameters", [1]),
            ("parameters", {"R": "1k"}),
            ("parameters", {"2R": 1}),
        ):
            with self.subTest(key=key, value=value):
                self.assertFalse(passes({**EXAMPLE, key: value}))
                self.assertFalse(passes({**nonlinear, key: value}, NONLINEAR))

    def test_every_required_key_is_required(self):
        for key in EXAMPLE:
            with self.subTest(key=key):
                problem = copy.deepcopy(EXAMPLE)
                del problem[key]
                self.assertFalse(passes(problem))

    def test_mistakes_do_not_pass(self):
        for key, value in (
            ("A", [1]),
            ("A", []),
            ("N", [[None]]),
            ("x0", 1),
            ("T", "1"),
            ("T", 0),
            ("f", "t"),
            ("g", [[1]]),
            ("f", {"times": [0]}),
            ("pieces", []),
            ("pieces", [{"f": [1]}]),
            ("rule", "least"),
            ("selector", {"C": [[1]]}),
            ("kind", "nonlinear"),
            ("breakpoints", [1]),
            ("name", 7),
        ):
            with self.subTest(key=key, value=value):
                self.assertFalse(passes({**EXAMPLE, key: value}))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
