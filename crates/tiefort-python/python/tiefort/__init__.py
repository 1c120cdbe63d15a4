"""Elevation rasters in; meshes, and seamless terrain databases within polygon limits, out.

Examples
--------
>>> import numpy as np, tiefort
>>> mesh = tiefort.tin(np.random.default_rng(1).random((50, 50)), points=100)
>>> mesh.vertices.shape
(100, 3)

Heights are in metres, places in metres of the raster's system: east, north, up. All that needs memory or time runs
without Python's lock. Builds and meshes end within a second of Ctrl-C, answers for millions of places after the block
that is being computed.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    __version__: str
    from ._database import Database, LineOfSight, Obstacle, Profile, Viewshed, open
    from ._errors import (
        BusyError,
        ClosedError,
        DatabaseError,
        InternalError,
        JobError,
        OutputError,
        RequestError,
        SourceError,
        StoppedError,
        TiefortError,
        TiefortWarning,
    )
    from ._job import Job, Verdict, build, compare, export, plan, tile, verify
    from ._mesh import Mesh, Residual, tin
    from ._progress import Progress
    from ._report import Report

__all__ = [
    "BusyError",
    "ClosedError",
    "Database",
    "DatabaseError",
    "InternalError",
    "Job",
    "JobError",
    "LineOfSight",
    "Mesh",
    "Obstacle",
    "OutputError",
    "Profile",
    "Progress",
    "Report",
    "RequestError",
    "Residual",
    "SourceError",
    "StoppedError",
    "TiefortError",
    "TiefortWarning",
    "Verdict",
    "Viewshed",
    "build",
    "compare",
    "correlate",
    "export",
    "open",
    "plan",
    "tile",
    "tin",
    "verify",
]

_HOMES = {
    "_database": ("Database", "LineOfSight", "Obstacle", "Profile", "Viewshed", "open"),
    "_errors": (
        "BusyError",
        "ClosedError",
        "DatabaseError",
        "InternalError",
        "JobError",
        "OutputError",
        "RequestError",
        "SourceError",
        "StoppedError",
        "TiefortError",
        "TiefortWarning",
    ),
    "_job": ("Job", "Verdict", "build", "compare", "correlate", "export", "plan", "tile", "verify"),
    "_mesh": ("Mesh", "Residual", "tin"),
    "_progress": ("Progress",),
    "_report": ("Report",),
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return importlib.import_module("importlib.metadata").version(__name__)
    # Found when they are asked for, so that the command starts without NumPy.
    for home, names in _HOMES.items():
        if name in names:
            found = getattr(importlib.import_module(f"{__name__}.{home}"), name)
            globals()[name] = found
            return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
