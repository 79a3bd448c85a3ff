#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Counts the floating-point constants of the engine: named ones, and literals that have no name.

    constants.py PROJECT_FOLDER           # how many each folder of core has
    constants.py PROJECT_FOLDER FOLDER    # which ones core/FOLDER has itself

A named one is declared as `constexpr double kName` or `const double kName`; an array counts once. Literals are those in
other code, but for integers up to 16, halves of them and powers of two, which mean what they say. Coefficients of a
method, such as the nodes of a quadrature, do not count: the comment above their declaration begins with "Table:".
Neither do names of what nobody chooses: infinity and other limits of doubles, and multiples of π.
"""

import collections
import math
import pathlib
import re
import sys

DECLARATION = re.compile(r"^\s*(?=(?:\w+ )*(?:constexpr|const) )(?:(?:static|inline|constexpr|const) )+double k[A-Z]")
NAME = re.compile(r"(?:\bdouble|,)\s+(k[A-Z]\w*)\s*(?:\[\w*\]\s*)?[=;]")
LITERAL = re.compile(
    r"(?<![\w.])(?:0[xX][\da-fA-F.]+[pP][-+]?\d+|(?:\d+\.\d*|\.\d+)(?:[eE][-+]?\d+)?|\d+[eE][-+]?\d+)(?![\w.])"
)
GIVEN = re.compile(
    r"=\s*[-+*/\d.\s]*(?:std::numbers::\w+|std::numeric_limits<double>::(?:infinity|quiet_NaN|max|min|denorm_min)\(\))"
    r"[-+*/\d.\s]*;"
)
LARGEST_INTEGER = 16


def code_of(text):
    """The text with blanks for comments and the contents of strings, so that lines and columns remain."""
    pattern = re.compile(r"//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])'", re.S)
    return pattern.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)


def is_plain(literal):
    value = float.fromhex(literal) if literal[:2] in ("0x", "0X") else float(literal)
    return value == 0 or math.frexp(value)[0] == 0.5 or (value <= LARGEST_INTEGER and 2 * value == int(2 * value))


def is_table(lines, first):
    """Whether the comment above line `first` says so."""
    above = first - 1
    while above > 0 and lines[above - 1].lstrip().startswith("//"):
        above -= 1
    return lines[above].lstrip().startswith("// Table:")


def constants(path):
    """Named constants and literals of a file, each with the number of its line."""
    text = path.read_text()
    lines, code = text.split("\n"), code_of(text).split("\n")
    named, literals = [], []
    number = 0
    while number < len(code):
        first, statement = number, code[number]
        if DECLARATION.match(statement):
            while ";" not in code[number] and number + 1 < len(code):
                number += 1
                statement += " " + code[number]
            if not is_table(lines, first) and not GIVEN.search(statement):
                named += [(first + 1, name) for name in NAME.findall(re.sub(r"\{[^}]*\}", "", statement))]
        else:
            literals += [(number + 1, literal) for literal in LITERAL.findall(statement) if not is_plain(literal)]
        number += 1
    return named, literals


def main():
    core = pathlib.Path(sys.argv[1]) / "core"
    files = sorted(path for path in core.rglob("*") if path.suffix in (".cc", ".h"))
    if len(sys.argv) > 2:
        for path in files:
            if path.parent == core / sys.argv[2]:
                for line, what in sorted(sum(constants(path), [])):
                    print(f"{path.relative_to(core.parent)}:{line}: {what}")
        return
    counts = collections.defaultdict(lambda: [0, 0])
    for path in files:
        for place, found in enumerate(constants(path)):
            counts[str(path.parent.relative_to(core))][place] += len(found)
    print(f"{'folder':20}{'named':>8}{'literals':>10}")
    for folder, (named, literals) in sorted(counts.items(), key=lambda count: (-sum(count[1]), count[0])):
        if named + literals > 0:
            print(f"{folder:20}{named:8}{literals:10}")
    print(f"{'all':20}{sum(c[0] for c in counts.values()):8}{sum(c[1] for c in counts.values()):10}")


if __name__ == "__main__":
    main()
