"""The command ``tiefort``: the program itself, in this process."""

from __future__ import annotations

import os
import shutil
import sys

from ._tiefort import command_line


def main() -> None:
    """Run the program with the words of the command line and end with its exit code."""
    script = sys.argv[0]
    if not os.path.basename(script).startswith("tiefort"):
        # As a module, under a name that is not typed to run it again.
        script = shutil.which("tiefort") or "tiefort"
    command_line([script, *sys.argv[1:]])
