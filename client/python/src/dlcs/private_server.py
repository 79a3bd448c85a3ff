# SPDX-License-Identifier: Apache-2.0
"""A dlcsd of this process alone, on a Unix socket that only its user may open. It ends with the process."""

import atexit
import contextlib
import ctypes
import fcntl
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import threading
from typing import Dict, Optional

from .errors import Unavailable
from .programs import find_program

_PREFIX = "dlcs-private-"
_SECONDS_TO_START = 60
_PR_SET_PDEATHSIG = 1
_LIBC = ctypes.CDLL(None, use_errno=True)
_lock = threading.Lock()
_servers: Dict[str, "_Server"] = {}  # by their programs
_owner = os.getpid()


def private_server(dlcsd: Optional[str] = None) -> str:
    """The address of the private server of this process, which is started if none runs. Threads may call it.

    Args:
      dlcsd: the program; by default that in the variable DLCSD, or dlcsd on the PATH.
    Raises:
      InvalidArgument: dlcsd is no name of a program.
      Unavailable: there is no such program, or it does not start.
    """
    global _owner
    program = os.path.realpath(
        find_program("dlcsd", dlcsd, "install dlcsd, set DLCSD to it, or give server=HOST:PORT")
    )
    with _lock:
        if _owner != os.getpid():  # a fork has no server of its own yet
            _servers.clear()
            _owner = os.getpid()
        if program not in _servers or not _servers[program].runs():
            _servers[program] = _Server(program)
        return _servers[program].address


def _renew_lock() -> None:
    """Called in a fork, since another thread may have held the lock when it was made."""
    global _lock
    _lock = threading.Lock()


os.register_at_fork(after_in_child=_renew_lock)


class _Server:
    """A running dlcsd with a folder of its own for its socket."""

    def __init__(self, program: str):
        _remove_folders_of_dead_processes()
        self._parent = os.getpid()
        self._folder = pathlib.Path(tempfile.mkdtemp(prefix=_PREFIX))  # mode 0700
        self._alive = _locked(self._folder / "lock")
        self.address = f"unix:{self._folder}/socket"
        self._process: Optional[subprocess.Popen] = None
        self._error = ""
        self._started = threading.Event()
        # The kernel ends the child with the thread that started it: this one lives as long as the process.
        threading.Thread(target=self._run, args=(program,), name="dlcsd", daemon=True).start()
        try:
            if not self._started.wait(_SECONDS_TO_START):
                self._error = f"it was not ready after {_SECONDS_TO_START} s"
            if self._error:
                raise Unavailable(f"{program} did not start: {self._error}", "UNAVAILABLE")
        except BaseException:  # Ctrl-C too
            self.stop()
            raise
        atexit.register(self.stop)

    def runs(self) -> bool:
        return self._process is not None and self._process.poll() is None

    def stop(self) -> None:
        if os.getpid() != self._parent:  # in a fork
            return
        if self._process is not None:
            self._process.terminate()
            try:
                self._process.wait(timeout=5)
            except subprocess.TimeoutExpired:
                self._process.kill()
        shutil.rmtree(self._folder, ignore_errors=True)
        with contextlib.suppress(OSError):
            os.close(self._alive)

    def _run(self, program: str) -> None:
        try:
            self._process = process = subprocess.Popen(
                # The caller decides how many of its threads solve at once.
                [program, "--listen", self.address, "--max-concurrent-solves", "1024"],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                preexec_fn=self._end_with_parent,
                start_new_session=True,  # Ctrl-C is for the caller, which may continue
                text=True,
            )
        except (OSError, subprocess.SubprocessError) as error:
            self._error = str(error)
            self._started.set()
            return
        with process.stdout, process.stderr:
            if not process.stdout.readline().startswith("dlcsd listening on "):
                os.killpg(process.pid, signal.SIGKILL)
                self._error = process.stderr.read().strip() or "it is not a dlcsd, or ended without a message"
            self._started.set()
            for _ in process.stderr:  # discards the log, which must not fill the pipe
                pass
        process.wait()

    def _end_with_parent(self) -> None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != self._parent:
            os._exit(1)


def _locked(path: pathlib.Path) -> int:
    """A new file whose lock the system keeps until this process and its forks have ended, however they end."""
    new = path.with_suffix(".new")
    file = os.open(new, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
    fcntl.flock(file, fcntl.LOCK_EX)
    new.rename(path)  # nobody sees it without its lock
    return file


def _remove_folders_of_dead_processes() -> None:
    """Removes folders that a process killed by kill -9 has left. A folder without a lock file is just being created."""
    for folder in pathlib.Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"):
        with contextlib.suppress(OSError):  # of another user, or gone
            if folder.is_symlink() or folder.stat().st_uid != os.geteuid():
                continue
            file = os.open(folder / "lock", os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(folder, ignore_errors=True)
            finally:
                os.close(file)
