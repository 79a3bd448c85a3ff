# SPDX-License-Identifier: Apache-2.0
"""The documents of the project, and the files, commands and programs in them.

A fenced block with a language and a name, as "```json circuit.json", is a file. An indented block is one of

    $ command            a command with its output below it; \\ at the end continues a command
    command              commands, if the first word is a program
    import numpy         Python, if it begins with import
    anything else        a formula, a picture, an excerpt
"""

import pathlib
import re
import shutil
from typing import Iterator, List, NamedTuple


class Block(NamedTuple):
    """`kind` is "commands", "output" (commands with their output), "python" or "text"."""

    kind: str
    line: int  # of the document
    lines: List[str]
    section: str  # the heading of the second level above it


class Command(NamedTuple):
    text: str  # its lines
    line: int
    output: List[str]


# Programs in documents that need not be installed here, and commands of the shell.
_PROGRAMS = ("dlcs", "dlcsd", "buf", "docker", "kubectl", "npm", "systemctl", "cd", "export", "umask")
# Programs that are the first word of a formula.
_LETTERS = ("w", "x", "y")


def documents(project: pathlib.Path) -> List[pathlib.Path]:
    return sorted(
        path
        for top in project.iterdir()
        if top.name not in ("build", ".git")
        for path in ([top] if top.suffix == ".md" else top.rglob("*.md"))
        if "node_modules" not in path.parts
    )


def files_of(text: str) -> Iterator[tuple]:
    """Name and content of the files that a document shows."""
    for match in re.finditer(r"^```\w+ (\S+)\n(.*?)^```$", text, re.M | re.S):
        yield match[1], match[2]


def inline_code_of(text: str) -> List[str]:
    """What is between backticks, each in one line."""
    text = re.sub(r"^```(.|\n)*?^```$|^    .*$", "", text, flags=re.M)
    return [" ".join(code.split()) for code in re.findall(r"`([^`]+)`", text)]


def blocks_of(text: str) -> Iterator[Block]:
    section = ""
    lines = re.sub(r"^```.*?^```$", lambda fence: "\n" * fence[0].count("\n"), text, flags=re.M | re.S).split("\n")
    k = 0
    while k < len(lines):
        heading = re.match(r"## (.*)", lines[k])
        section = heading[1] if heading else section
        begins = lines[k].startswith("    ") and (k == 0 or not lines[k - 1].strip())
        if not begins or _is_in_list(lines, k):
            k += 1
            continue
        end = k
        while end < len(lines) and (lines[end].startswith("    ") or not lines[end].strip()):
            end += 1
        block = [line[4:] for line in lines[k:end]]
        while block and not block[-1].strip():
            block.pop()
        yield Block(_kind_of(block), k + 1, block, section)
        k = end


def _is_in_list(lines: List[str], k: int) -> bool:
    """Whether an indented line continues the item of a list."""
    while k > 0 and (lines[k].startswith("  ") or not lines[k].strip()):
        k -= 1
    return re.match(r"([-*]|\d+\.) ", lines[k]) is not None


def _kind_of(block: List[str]) -> str:
    if block[0].startswith("$ "):
        return "output"
    if re.match(r"(import|from) \w+", block[0]):
        return "python"
    # After a leading comment, assignments and an opening parenthesis.
    code = next((line for line in block if not line.startswith("#")), "")
    word = re.match(r"(?:\w+=\S+ +)*\(*([\w./-]+)", code)
    shell = re.match(r"(until |if |for |\w+=\S)", code)
    if shell or (word and is_program(word[1])):
        return "commands"
    return "text"


def is_program(word: str) -> bool:
    if word in _LETTERS:
        return False
    return word in _PROGRAMS or word.startswith(("deploy/", "build/", "tests/")) or shutil.which(word) is not None


def commands_of(block: Block) -> List[Command]:
    """The commands of a block. Lines that end with \\ or &&, and a here document, belong to one."""
    result: List[Command] = []
    k = 0
    while k < len(block.lines):
        shown = block.kind == "output" and block.lines[k].startswith("$ ")
        if block.kind == "output" and not shown:
            result[-1].output.append(block.lines[k])
            k += 1
            continue
        begin = k
        text = block.lines[k][2:] if shown else block.lines[k]
        here = re.search(r"<<'(\w+)'", text)
        while k + 1 < len(block.lines) and (
            text.rstrip().endswith(("\\", "&&")) or (here and block.lines[k] != here[1])
        ):
            k += 1
            text += "\n" + block.lines[k]
        if text.strip() and not text.startswith("#"):
            result.append(Command(text, block.line + begin, []))
        k += 1
    return result
