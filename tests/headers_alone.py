#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compiles each header of the project by itself, as the files of its folder are compiled.

    headers_alone.py BUILD_FOLDER    a build without unity builds, for its compile_commands.json

Exit code 1 if one does not compile. deploy/check-build.sh runs it.
"""
import json
import os
import pathlib
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

ROOT = pathlib.Path(__file__).resolve().parent.parent


def command_by_folder(build):
    """The compiler and its flags, without input, output and precompiled headers, of one file of each folder: that with
    the most folders to include from, since targets of one folder may use different libraries."""
    def folders_of(words):
        return sum(word.startswith(("-I", "-isystem")) for word in words)

    commands = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        folder = pathlib.Path(entry["file"]).parent
        if not folder.is_relative_to(ROOT):
            continue
        words = shlex.split(entry["command"])
        words = words[next(i for i, word in enumerate(words) if word.endswith("++")):]
        kept, skip = [], False
        for word in words:
            if skip or word in ("-c", entry["file"]):
                skip = False
            elif word in ("-o", "-include"):
                skip = True
            elif not word.startswith("-fpch"):
                kept.append(word)
        if folder not in commands or folders_of(kept) > folders_of(commands[folder][0]):
            commands[folder] = (kept, entry["directory"])
    return commands


def nearest(commands, header):
    """The command of the header's folder, or of one above or below it."""
    for folder in [header.parent, *header.parent.parents]:
        for known in sorted(commands):
            if known == folder or known.is_relative_to(folder):
                return commands[known]
    raise LookupError(header)


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    commands = command_by_folder(build)
    tracked = subprocess.run(["git", "ls-files", "*.h"], cwd=ROOT, capture_output=True, text=True, check=True)
    headers = [ROOT / line for line in tracked.stdout.splitlines()]

    def compile_header(header):
        flags, folder = nearest(commands, header)
        # In a file of its own: GCC warns of "#pragma once" and the like in a main file that is a header.
        return subprocess.run([*flags, "-fsyntax-only", "-x", "c++", "-"], cwd=folder, text=True, capture_output=True,
                              input=f'#include "{header.relative_to(ROOT)}"\n')

    failed = 0
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for header, result in zip(headers, pool.map(compile_header, headers)):
            if result.returncode != 0:
                failed += 1
                print(f"{header.relative_to(ROOT)} does not compile by itself:\n{result.stderr}")
    print(f"{len(headers) - failed} of {len(headers)} headers compile by themselves.")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
