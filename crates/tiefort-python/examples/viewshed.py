"""Draws in letters what is seen from a place of a terrain database: ``viewshed.py DATABASE EAST NORTH [RANGE]``."""

from __future__ import annotations

import sys

import tiefort


def main(words: list[str]) -> None:
    """Draw it."""
    path, east, north = words[0], float(words[1]), float(words[2])
    range_m = float(words[3]) if 3 < len(words) else 2000.0
    with tiefort.open(path) as database:
        seen = database.viewshed((east, north), range_m, spacing_m=range_m / 24)
    for row in seen.visible:
        print("".join("#" if visible else "." for visible in row))


if __name__ == "__main__":
    main(sys.argv[1:])
