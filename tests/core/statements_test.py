# SPDX-License-Identifier: Apache-2.0
"""core/analysis/PAPERS.md tells the truth: no row of its tables is empty, and the functions, files and tests that it
names exist.

    statements_test.py PROJECT_FOLDER TEST_PROGRAM...
"""

import pathlib
import re
import subprocess
import sys
import unittest

PROJECT, PROGRAMS = pathlib.Path(sys.argv[1]), sys.argv[2:]
EMPTY = "–"  # only in rows marked "existence statement"


def tests_of(program):
    """Suite.Name of every test, without the parameters of value-parameterized ones."""
    suite = ""
    listing = subprocess.run([program, "--gtest_list_tests"], check=True, capture_output=True, text=True).stdout
    for line in listing.splitlines():
        line = line.split("#")[0].rstrip()
        if line.endswith("."):
            suite = next(part for part in reversed(line[:-1].split("/")) if not part.isdigit()) + "."
        elif line.startswith("  "):
            yield suite + line.strip().split("/")[0]


def rows():
    for line in (PROJECT / "core/analysis/PAPERS.md").read_text().splitlines():
        if line.startswith("|") and not re.match(r"\| (statement|---)", line):
            yield [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]


SOURCES = {
    path.relative_to(PROJECT).as_posix(): path.read_text()
    for folder in ("core", "tests/support", "client", "deploy/examples")
    for path in (PROJECT / folder).rglob("*")
    if path.suffix in (".h", ".cc", ".json")
}
TESTS = {test for program in PROGRAMS for test in tests_of(program)}


class StatementsTest(unittest.TestCase):
    def test_has_rows_of_four_cells_and_none_is_empty(self):
        self.assertGreater(len(list(rows())), 80)
        for row in rows():
            with self.subTest(row[0]):
                self.assertEqual(len(row), 4)
                self.assertTrue(all(row))
                if EMPTY in row[2:]:
                    self.assertIn("existence statement", " ".join(row))

    def test_names_tests_that_exist(self):
        for row in rows():
            suite = ""
            for name in row[3].split(", "):
                if name == EMPTY:
                    continue
                with self.subTest(row[0], test=name):
                    self.assertRegex(name, r"^\w*\.\w*\*?$")
                    suite = name.split(".")[0] or suite
                    pattern = re.escape(suite + "." + name.split(".")[1]).replace(r"\*", ".*")
                    self.assertTrue(any(re.fullmatch(pattern, test) for test in TESTS))

    def test_names_functions_and_files_that_exist(self):
        for row in rows():
            for name in re.findall(r"`([^`]+)`", row[2]):
                with self.subTest(row[0], name=name):
                    if "/" in name:
                        self.assertTrue(
                            any(re.search(rf"(^|/){re.escape(name)}(\.h|\.cc)?$", path) for path in SOURCES)
                        )
                    else:
                        word = re.escape(name.split("::")[-1].rstrip("()"))
                        self.assertTrue(any(re.search(rf"\b{word}\b", text) for text in SOURCES.values()))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
