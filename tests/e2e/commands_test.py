#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every command of every document works, and prints what the document shows.

    commands_test.py PROJECT_FOLDER DLCS DLCSD [--write-pictures] [DOCUMENT...]

The commands of a document run in their order in one shell, in a folder with the files that the document shows and with
links to those of the project. Below a command with `$` its output is shown: "..." stands for any number of lines, and
blank lines do not count. Numbers agree to a millionth, or in the digits that are shown. At each heading of the second
level the servers that were started end. Commands within sentences follow if they name a file of the project. NOT_RUN
lists what is not run, and why.

A picture beside a document that has the name of an SVG file that its commands write is that file, without the empty
groups of gnuplot; --write-pictures writes it.

Documents name ports, so each runs in a network of its own (Linux namespaces). Exit code 77 where there are none.
"""

import contextlib
import fcntl
import os
import pathlib
import re
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import unittest
from concurrent.futures import ThreadPoolExecutor

sys.dont_write_bytecode = True
from database import Database  # noqa: E402
from documents import blocks_of, commands_of, documents, files_of, inline_code_of  # noqa: E402

INSIDE = "--inside"  # of the namespaces, with the socket of the database
ARGUMENTS = [word for word in sys.argv[1:] if not word.startswith("--")]
PROJECT, DLCS, DLCSD = (pathlib.Path(word).resolve() for word in (ARGUMENTS + 3 * [""])[:3])
CHOSEN = [pathlib.Path(word).resolve() for word in ARGUMENTS[3:]]
WRITE_PICTURES = "--write-pictures" in sys.argv
AT_ONCE = 2  # documents that run at the same time; they spend most of it starting programs
SKIPPED = 77
UNSHARE = ["unshare", "--net", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc"]
if os.geteuid() != 0:
    UNSHARE.append("--map-root-user")

# Commands that are not run: the reason, and regular expressions for their beginning.
NOT_RUN = (
    ("builds everything; CI runs test.sh", "deploy/quickstart.sh", "deploy/test.sh", "deploy/check-build.sh"),
    ("takes long, and needs a build by Clang", "deploy/fuzz.sh"),
    ("takes minutes on a quiet machine, to measure it", r"DLCSD=\$PWD", "tests/bench/"),
    ("takes a minute or more", "tests/load/store_plan.py --server-cores", "tests/fleet/"),
    ("needs programs that were built from another commit", "tests/upgrade/record.py"),
    ("builds everything, or runs what that builds; CI does both", "cmake ", "ctest ", r"(\w+=\S+ )*build/\w+/"),
    ("needs a container engine; test-image.sh, test-compose.sh", "docker ", r"DLCS_DATABASE_PASSWORD=\w+ docker "),
    ("needs a cluster; ManifestsTest checks the manifests", "kubectl ", r"\(cd deploy/kubernetes "),
    ("needs systemd; ManifestsTest", "install -m 644 deploy/dlcsd.service", "systemctl ", "dlcs health && journalctl"),
    ("needs the system's PostgreSQL, and asks for a password; Database makes the same", "runuser -u postgres"),
    ("needs MPI; MpiTest runs it", "mpirun "),
    ("installs packages that nothing else needs", "deploy/install-packages.sh build mpi petsc"),
    ("needs MPI; MpiJobsTest runs it", "dlcsd .*--mpi-launcher", "dlcs submit .*--ranks"),
    ("needs a registry; the build runs it", "npm "),
    ("needs a registry; PythonClientTest builds and installs the wheel", "pip install "),
    ("needs buf from npm; ContractGuardTest", "buf "),
)
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.])")


def runs(command):
    return not any(re.match(pattern, command) for _, *patterns in NOT_RUN for pattern in patterns)


def last_digit(number):
    """One unit in the last place that a number shows."""
    digits, _, exponent = number.partition("e")
    return 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2])) if "." in digits else 0


def same(shown, printed, slack=0.0):
    """Whether two lines agree: the words exactly, the numbers nearly."""
    if NUMBER.sub("#", shown).split() != NUMBER.sub("#", printed).split():
        return False
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(printed))
    return all(abs(float(a) - float(b)) <= 1e-9 + slack + 1e-6 * abs(float(b)) + last_digit(a) for a, b in pairs)


def difference(shown, output):
    """The first of the `shown` lines that is not the next one of `output`, or None if all are. "..." skips lines."""
    printed = [line for line in output.splitlines() if line.strip()]
    at, may_skip = 0, False
    for line in filter(str.strip, shown):
        if line.strip() == "...":
            may_skip = True
            continue
        while may_skip and at < len(printed) and not same(line, printed[at]):
            at += 1
        if at == len(printed) or not same(line, printed[at]):
            return line
        at, may_skip = at + 1, False
    return None if may_skip or at == len(printed) else "(the end)"


def without_empty_groups(svg):
    """Removes empty groups: gnuplot opens one for each change of its pen, and draws nothing in most of them."""
    while True:
        smaller = re.sub(r"<g [^>]*>\s*</g>\n?", "", svg)
        if smaller == svg:
            return re.sub(r"[ \t]+$", "", svg, flags=re.M)
        svg = smaller


class Document:
    """The commands of a document as one script."""

    def __init__(self, path, folder):
        self.path = path
        self.text = path.read_text()
        self.folder = pathlib.Path(folder)
        self.commands = 0
        self.outputs = {}  # number of a command -> what the document shows
        for entry in PROJECT.iterdir():
            if entry.name not in ("build", ".git"):
                (self.folder / entry.name).symlink_to(entry)
        for name, content in files_of(self.text):
            (self.folder / name).write_text(content)
        (self.folder / "home").mkdir()
        self.script = "\n".join(self._script())

    def _script(self):
        yield "set -e"
        yield "trap 'echo \"line $LINE: exit code $?\" >&2' ERR"
        yield "trap 'kill $(jobs -p) 2>/dev/null || true' EXIT"
        section = ""
        for block in blocks_of(self.text):
            if block.section != section:
                section = block.section
                yield "kill $(jobs -p) 2>/dev/null || true; wait"
            if block.kind == "python":
                self.commands += 1
                (self.folder / f"block{self.commands}.py").write_text("\n".join(block.lines) + "\n")
                yield f"LINE={block.line}; PYTHONPATH=$PACKAGE /usr/bin/python3 block{self.commands}.py"
            elif block.kind != "text":
                for command in commands_of(block):
                    if not runs(command.text):
                        continue
                    self.commands += 1
                    yield f"LINE={command.line}"
                    if block.kind == "output" and not command.text.rstrip().endswith("&"):
                        self.outputs[self.commands] = command
                        yield f"{{ {command.text}\n}} > output{self.commands}"
                    else:
                        yield command.text
        for code in inline_code_of(self.text):
            if re.match(r"dlcs \w+ (deploy|tests)/", code):
                self.commands += 1
                yield code
        yield "kill $(jobs -p) 2>/dev/null || true; wait"

    def run(self):
        environment = {
            "HOME": str(self.folder / "home"),
            "PATH": f"{DLCS.parent}:{DLCSD.parent}:/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin",
            "PACKAGE": str(PROJECT / "client/python/src"),
            "PYTHONDONTWRITEBYTECODE": "1",
            "LANG": "C.UTF-8",
        }
        (self.folder / "script").write_text(self.script)
        command = [*UNSHARE, sys.executable, os.path.abspath(__file__), INSIDE, CommandsTest.database.socket]
        return subprocess.run(command, cwd=self.folder, env=environment, capture_output=True, text=True, timeout=300)


class CommandsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.database = Database()

    @classmethod
    def tearDownClass(cls):
        cls.database.stop()

    def test_commands_work_and_print_what_is_shown(self):
        with contextlib.ExitStack() as stack:
            all_documents = [
                Document(path, stack.enter_context(tempfile.TemporaryDirectory()))
                for path in CHOSEN or documents(PROJECT)
            ]
            with_commands = [document for document in all_documents if document.commands]
            with ThreadPoolExecutor(AT_ONCE) as pool:
                for document, done in zip(with_commands, pool.map(Document.run, with_commands)):
                    with self.subTest(document.path.relative_to(PROJECT)):
                        self.assertEqual(done.returncode, 0, f"{done.stderr[-3000:]}\n{done.stdout[-1000:]}")
                        self.check_outputs(document)
                        self.check_pictures(document)

    def check_outputs(self, document):
        for number, command in document.outputs.items():
            output = (document.folder / f"output{number}").read_text()
            self.assertIsNone(difference(command.output, output), f"{command.text}\n{output}")

    def check_pictures(self, document):
        for name in re.findall(r"!\[[^\]]*\]\(([\w-]+\.svg)\)", document.text):
            drawn = without_empty_groups((document.folder / name).read_text())
            kept = document.path.parent / name
            if WRITE_PICTURES:
                kept.write_text(drawn)
            self.assertLess(len(drawn), 60_000, name)
            ours, theirs = kept.read_text().splitlines(), drawn.splitlines()
            self.assertEqual(len(ours), len(theirs), name)
            for one, other in zip(ours, theirs):
                # Allows a tenth of a pixel, or a digit of the estimated error in the title.
                self.assertTrue(same(one, other, slack=0.1), f"{name}\n{one}\n{other}")

    def test_nothing_that_looks_like_a_command_is_taken_for_text(self):
        for path in documents(PROJECT):
            for block in blocks_of(path.read_text()):
                if block.kind == "text":
                    with self.subTest(path.relative_to(PROJECT), line=block.line):
                        self.assertNotRegex(block.lines[0], r"^[\w./-]+ .*--?[a-z]+( |=|$)")
                        self.assertNotRegex(block.lines[0], r"\$\(|&$")

    def test_every_exception_is_needed(self):
        commands = [
            command.text
            for path in documents(PROJECT)
            for block in blocks_of(path.read_text())
            if block.kind in ("commands", "output")
            for command in commands_of(block)
        ]
        self.assertGreater(len(commands), 80)
        for _, *patterns in NOT_RUN:
            for pattern in patterns:
                self.assertTrue(any(re.match(pattern, command) for command in commands), pattern)

    def test_scripts_programs_and_presets_exist(self):
        """Of the commands that are not run, and of those between backticks."""
        presets = (PROJECT / "CMakePresets.json").read_text()
        tests = "".join(path.read_text() for path in (PROJECT / "tests").rglob("*_test.cc"))
        for path in documents(PROJECT):
            text = path.read_text()
            shown = [c.text for block in blocks_of(text) if block.kind == "commands" for c in commands_of(block)]
            shown += inline_code_of(text)
            for command in shown:
                with self.subTest(path.relative_to(PROJECT), command=command):
                    for script in re.findall(r"(?<![\w/])deploy/[\w-]+\.(?:sh|py)", command):
                        self.assertTrue(os.access(PROJECT / script, os.X_OK))
                    for preset in re.findall(r"--preset (\w+)", command):
                        self.assertIn(f'"name": "{preset}"', presets)
                    for preset, folder, program in re.findall(r"build/(\w+)/(tests/\w+)/([a-z]+_\w+)", command):
                        self.assertIn(f'"name": "{preset}"', presets)
                        name = program.removesuffix("_fuzz")
                        self.assertRegex((PROJECT / folder / "CMakeLists.txt").read_text(), rf"\b{name}\b")
                    for filters in re.findall(r"--gtest_filter='([^']+)'", command):
                        for suite in re.findall(r"(?:^|:)(\w+)", filters):
                            self.assertRegex(tests, rf"\bTEST(_[FP])?\({suite}")

    def test_flags_in_the_text_exist(self):
        """Those of `dlcs COMMAND ...` and `dlcsd ...` between backticks."""
        known = {}

        def help_of(*words):
            if words not in known:
                done = subprocess.run([*words, "--help"], capture_output=True, text=True)
                known[words] = done.stdout if done.returncode == 0 else ""
            return known[words]

        for path in documents(PROJECT):
            for code in filter(re.compile(r"dlcsd?( |$)").match, inline_code_of(path.read_text())):
                words = code.split()
                if words[0] == "dlcs" and len(words) > 1 and re.fullmatch(r"(?!help)[a-z]+", words[1]):
                    listing = help_of(str(DLCS), words[1])
                else:
                    listing = help_of(str(DLCS if words[0] == "dlcs" else DLCSD))
                with self.subTest(path.relative_to(PROJECT), code=code):
                    self.assertTrue(listing, "is no command")
                    for flag in re.findall(r"(?<!\S)--[a-z-]+", code):
                        self.assertIn(flag, listing)


# The network and the database.


def run_inside(database):
    """Runs the script of the working folder, with a loopback interface, and with its writes elsewhere discarded."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        up_and_running = struct.pack("16sh", b"lo", 0x1 | 0x40)
        fcntl.ioctl(any_socket, 0x8914, up_and_running)  # SIOCSIFFLAGS
    subprocess.run(["mount", "-t", "tmpfs", "tmpfs", "/var/lib"], check=True)
    relay(database)
    return subprocess.run(["bash", "script"]).returncode


def relay(database):
    """localhost:5432 for the PostgreSQL server outside, which listens on a Unix socket."""
    listener = socket.create_server(("127.0.0.1", 5432))

    def copy(source, target):
        with contextlib.suppress(OSError):  # one end is gone
            while data := source.recv(65536):
                target.sendall(data)
            target.shutdown(socket.SHUT_WR)

    def serve():
        while True:
            near, _ = listener.accept()
            far = socket.socket(socket.AF_UNIX)
            far.connect(database)
            for one, other in ((near, far), (far, near)):
                threading.Thread(target=copy, args=(one, other), daemon=True).start()

    threading.Thread(target=serve, daemon=True).start()


def main():
    if sys.argv[1] == INSIDE:
        sys.exit(run_inside(sys.argv[2]))
    if subprocess.run([*UNSHARE, "true"], capture_output=True).returncode != 0:
        print("skipped: no namespaces here")
        sys.exit(SKIPPED)
    unittest.main(argv=sys.argv[:1])


if __name__ == "__main__":
    main()
