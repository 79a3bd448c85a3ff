# SPDX-License-Identifier: Apache-2.0
"""SPICE decks, read by the program dlcs."""

import os
import subprocess
from typing import Any, List, Optional

from . import messages
from .errors import InvalidArgument, Unavailable, Violation, invalid, shortened
from .problem import Problem, numbers
from .programs import find_program


def read_deck(
    path: Any,
    *,
    diode: Optional[str] = None,
    diode_current: Optional[float] = None,
    current_limit: Optional[float] = None,
    ideal_edges: bool = False,
    dlcs: Optional[str] = None,
) -> Problem:
    """The circuit of a SPICE deck as a Problem, whose outputs are what the deck prints, or all of its voltages and
    currents.

        solution = dlcs.solve(dlcs.read_deck("buck.cir"), tol=1e-8)
        solution.outputs["v(out)"], solution.measurements["vavg"]

    Args:
      path: the file; includes are looked for below its folder.
      diode, diode_current, current_limit, ideal_edges: as the options of `dlcs netlist`.
      dlcs: the program; by default that in the variable DLCS, or dlcs on the PATH.
    Raises:
      InvalidArgument: the deck has a fault, or something that is not supported; the message has file, line and column.
      Unavailable: there is no such program.
    """
    command = [
        find_program("dlcs", dlcs, "decks are read by dlcs; install it, or set DLCS to it"),
        "netlist",
        "--message",
    ]
    if diode is not None:
        command += ["--diode", str(diode)]
    if diode_current is not None:
        command += ["--diode-current", repr(float(numbers("diode_current", diode_current, 0)))]
    if current_limit is not None:
        command += ["--current-limit", repr(float(numbers("current_limit", current_limit, 0)))]
    if ideal_edges:
        command.append("--ideal-edges")
    try:
        file = os.fsdecode(path)
    except TypeError:
        raise invalid("path", f"{shortened(path)}; must be the name of a file") from None
    if "\0" in file:
        raise invalid("path", f"{shortened(path)}; must be the name of a file")
    command.append(file if not file.startswith("-") else os.path.join(".", file))
    run = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True)
    lines = _lines(run.stderr)
    if run.returncode != 0:
        said = "\n".join(lines) or f"dlcs ended with {run.returncode}"
        raise InvalidArgument(said, "INVALID_ARGUMENT", [Violation("path", said)])
    body = messages.ProblemBody.FromString(run.stdout)
    return Problem(body.problem, body.title, lines)


def _lines(text: bytes) -> List[str]:
    """The lines that the program printed, without its name in front."""
    lines = text.decode("utf-8", "replace").splitlines()
    return [line[len("dlcs: ") :] if line.startswith("dlcs: ") else line for line in lines]
