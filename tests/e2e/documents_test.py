#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Links in the documents have targets, and tables of files name files that exist. And no line of the project is longer
than 120 columns. commands_test.py runs the commands.

    documents_test.py PROJECT_FOLDER
"""

import itertools
import pathlib
import re
import sys
import unittest

sys.dont_write_bytecode = True
from documents import documents  # noqa: E402

PROJECT = pathlib.Path(sys.argv[1]).resolve()
DOCUMENTS = documents(PROJECT)
# Data, files of others, pictures, and what cannot be broken: rows of tables.
MAY_BE_LONG = re.compile(
    r"\.(csv|json|binpb|db|sql|svg)$|^(LICENSE|proto/google/|tests/fuzz/corpus/|tests/hostile/cases/)"
)


def files_named_in(text):
    """The names in the first column of tables of files: those headed "file", or by a folder in backticks."""
    for table in re.findall(r"^\| (?:file|`\w+/`) \|.*\n\|.*\n((?:\|.*\n)*)", text, re.M):
        for row in table.splitlines():
            yield from re.findall(r"`([^`]+)`", row.split("|")[1])


def anchors_of(text):
    for title in re.findall(r"^#+ (.*)$", text, re.M):
        yield re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


class DocumentsTest(unittest.TestCase):
    def test_there_are_documents(self):
        self.assertGreater(len(DOCUMENTS), 20)

    def test_links_lead_somewhere(self):
        for path in DOCUMENTS:
            for link in re.findall(r"\]\(([^)\s]+)\)", path.read_text()):
                if "://" in link:
                    continue
                with self.subTest(path.relative_to(PROJECT), link=link):
                    file, _, anchor = link.partition("#")
                    target = (path.parent / file).resolve() if file else path
                    self.assertTrue(target.exists())
                    if anchor:
                        self.assertIn(anchor, list(anchors_of(target.read_text())))

    def test_lines_have_at_most_120_columns(self):
        for folder in (".", ".ci", "core", "proto", "server", "client", "tests", "deploy"):
            for path in PROJECT.glob(f"{folder}/*" if folder == "." else f"{folder}/**/*"):
                name = path.relative_to(PROJECT).as_posix()
                if not path.is_file() or path.suffix == ".pyc" or MAY_BE_LONG.search(name):
                    continue
                for number, line in enumerate(path.read_text().splitlines(), 1):
                    if len(line) > 120 and not (path.suffix == ".md" and line.startswith("|")):
                        self.fail(f"{name}:{number} has {len(line)} columns")

    def test_tables_of_files_name_what_exists(self):
        for path in DOCUMENTS:
            for name in files_named_in(path.read_text()):
                with self.subTest(path.relative_to(PROJECT), name=name):
                    found = (path.parent.glob(f"**/{name.rstrip('/')}{end}") for end in ("", ".*"))
                    self.assertTrue(any(itertools.chain(*found)))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
