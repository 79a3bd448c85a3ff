# SPDX-License-Identifier: Apache-2.0
"""Finds the programs that the package runs."""

import os
import shutil
from typing import Optional

from .errors import Unavailable, invalid, shortened


def find_program(name: str, given: Optional[str], advice: str) -> str:
    """The path of the program `name`: `given`, or that in the variable of its name, or `name` on the PATH.

    Raises:
      DlcsError: `given` is no name of a program (INVALID_ARGUMENT), or there is none (UNAVAILABLE, with `advice`).
    """
    wanted = given or os.environ.get(name.upper()) or name
    if not isinstance(wanted, (str, os.PathLike)):
        raise invalid(name, f"{shortened(wanted)}; must be a program")
    found = shutil.which(wanted)
    if found is None:
        raise Unavailable(f"{wanted} is not a program: {advice}", "UNAVAILABLE")
    return found
