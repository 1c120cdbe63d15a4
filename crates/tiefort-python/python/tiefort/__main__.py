"""Runs the command: ``python -m tiefort``."""

from ._cli import main

main()
