# SPDX-License-Identifier: Apache-2.0
"""A dlcsd of this process alone, on a Unix socket that only its user may open. It ends with the process."""

import atexit
import ctypes
import os
import shutil
import signal
import subprocess
import tempfile
import threading
from typing import Dict, Optional

from .errors import Unavailable

_PR_SET_PDEATHSIG = 1
_LIBC = ctypes.CDLL(None, use_errno=True)
_lock = threading.Lock()
_servers: Dict[str, str] = {}  # program -> address
_owner = os.getpid()


def _program(dlcsd: Optional[str]) -> str:
    wanted = dlcsd or os.environ.get("DLCSD") or "dlcsd"
    found = shutil.which(wanted)
    if found is None:
        raise Unavailable(
            f"{wanted} is not a program: install dlcsd, set DLCSD to it, or give server=HOST:PORT", "UNAVAILABLE"
        )
    return os.path.realpath(found)


def private_server(dlcsd: Optional[str] = None) -> str:
    """The address of the private server of this process, which is started if there is none. Threads may call it.

    Args:
      dlcsd: the program; by default that in the variable DLCSD, or dlcsd on the PATH.
    Raises:
      Unavailable: there is no such program, or it does not start.
    """
    global _owner
    program = _program(dlcsd)
    with _lock:
        if _owner != os.getpid():  # a fork has no server of its own yet
            _servers.clear()
            _owner = os.getpid()
        if program not in _servers:
            _servers[program] = _start(program)
        return _servers[program]


def _start(program: str) -> str:
    folder = tempfile.mkdtemp(prefix="dlcs-")  # mode 0700
    address = f"unix:{folder}/socket"
    started = threading.Event()
    outcome: Dict[str, object] = {}
    parent = os.getpid()

    def end_with_parent() -> None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)

    def run() -> None:
        try:
            process = subprocess.Popen(
                [program, "--listen", address],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                preexec_fn=end_with_parent,
                text=True,
            )
        except OSError as error:
            outcome["error"] = str(error)
            started.set()
            return
        outcome["process"] = process
        line = process.stdout.readline()
        if not line.startswith("dlcsd listening on "):
            outcome["error"] = process.stderr.read().strip() or "it ended without a message"
        started.set()
        with process.stdout, process.stderr:
            for _ in process.stderr:  # its log, which must not fill the pipe
                pass
        process.wait()

    # The kernel ends the child with the thread that started it: this one lives as long as the process.
    threading.Thread(target=run, name="dlcsd", daemon=True).start()
    started.wait()
    if "error" in outcome:
        shutil.rmtree(folder, ignore_errors=True)
        raise Unavailable(f"{program} did not start: {outcome['error']}", "UNAVAILABLE")

    def stop() -> None:
        if os.getpid() == parent:
            outcome["process"].terminate()  # type: ignore[attr-defined]
            try:
                outcome["process"].wait(timeout=5)  # type: ignore[attr-defined]
            except subprocess.TimeoutExpired:
                outcome["process"].kill()  # type: ignore[attr-defined]
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(stop)
    return address
