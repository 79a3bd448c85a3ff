#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The documents tell the truth: links lead somewhere, tables of files name files that exist, and commands whose output
a document shows print it. And no line of the project is longer than 120 columns.

    documents_test.py PROJECT_FOLDER DLCS

A fenced block "```json FILE" or an indented `cat > FILE <<'END'` makes a file. An indented line `$ dlcs ...` is run in
a folder with these files and with deploy/ and tests/ of the project. The lines below it must be those of the output;
"..." stands for any number of lines, and blank lines do not count. Numbers agree to a millionth, or in the digits that
are shown.
"""

import itertools
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import unittest

PROJECT, DLCS = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2]
DOCUMENTS = sorted(
    path
    for top in PROJECT.iterdir()
    if top.name not in ("build", ".git")
    for path in ([top] if top.suffix == ".md" else top.rglob("*.md"))
)
# Data, files of others, and what cannot be broken: rows of tables.
MAY_BE_LONG = re.compile(r"\.(json|binpb|db)$|^(LICENSE|proto/google/|tests/fuzz/corpus/|tests/hostile/cases/)")
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.])")


def files_of(text):
    """Name and content of the files that a document makes."""
    for match in re.finditer(r"^```json (\S+)\n(.*?)^```$", text, re.M | re.S):
        yield match[1], match[2]
    for match in re.finditer(r"^    cat > (\S+) <<'END'\n(.*?)^    END$", text, re.M | re.S):
        yield match[1], match[2]


def commands_of(text):
    """Each shown command with the lines shown below it."""
    for match in re.finditer(r"^    \$ (dlcs .*)\n((?:    .*\n|\n(?=    ))*)", text, re.M):
        yield match[1], [line for line in match[2].splitlines() if line.strip()]


def same(shown, printed):
    """Whether two lines agree: the words exactly, the numbers nearly."""
    if NUMBER.sub("#", shown).split() != NUMBER.sub("#", printed).split():
        return False
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(printed))
    return all(abs(float(a) - float(b)) <= 1e-9 + 1e-6 * abs(float(b)) + last_digit(a) for a, b in pairs)


def last_digit(number):
    """One unit in the last place that a number shows."""
    digits, _, exponent = number.partition("e")
    return 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2])) if "." in digits else 0


def difference(shown, output):
    """The first of the `shown` lines that is not the next one of `output`, or None if all are. "..." skips lines."""
    printed = [line for line in output.splitlines() if line.strip()]
    at, may_skip = 0, False
    for line in shown:
        if line.strip() == "...":
            may_skip = True
            continue
        while may_skip and at < len(printed) and not same(line, printed[at]):
            at += 1
        if at == len(printed) or not same(line, printed[at]):
            return line
        at, may_skip = at + 1, False
    return None if may_skip or at == len(printed) else "(the end)"


def files_named_in(text):
    """The names in the first column of tables of files: those headed "file", or by a folder in backticks."""
    for table in re.findall(r"^\| (?:file|`\w+/`) \|.*\n\|.*\n((?:\|.*\n)*)", text, re.M):
        for row in table.splitlines():
            yield from re.findall(r"`([^`]+)`", row.split("|")[1])


def anchors_of(text):
    for title in re.findall(r"^#+ (.*)$", text, re.M):
        yield re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


class DocumentsTest(unittest.TestCase):
    def test_there_are_documents_with_commands(self):
        self.assertGreater(len(DOCUMENTS), 20)
        self.assertGreater(sum(len(list(commands_of(path.read_text()))) for path in DOCUMENTS), 4)

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

    def test_commands_print_what_is_shown(self):
        for path in DOCUMENTS:
            text = path.read_text()
            with tempfile.TemporaryDirectory() as folder:
                for name in ("deploy", "tests"):
                    (pathlib.Path(folder) / name).symlink_to(PROJECT / name)
                for name, content in files_of(text):
                    (pathlib.Path(folder) / name).write_text(content)
                for command, shown in commands_of(text):
                    with self.subTest(path.relative_to(PROJECT), command=command):
                        words = [DLCS, *shlex.split(command)[1:]]
                        run = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=60)
                        self.assertEqual(run.returncode, 0, run.stderr)
                        self.assertIsNone(difference(shown, run.stdout), run.stdout)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
