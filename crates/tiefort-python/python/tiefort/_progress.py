"""What a run tells while it runs."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Callable

from ._errors import TiefortWarning


@dataclass(frozen=True)
class Progress:
    """One thing that happened.

    Attributes
    ----------
    what : str
        ``enter`` and ``leave`` (a stage), ``started``, ``done`` and ``kept`` (a tile), ``because`` (why a tile is made
        again) or ``note``.
    stage : str or None
        The stage: ``read``, ``survey``, ``refine``, ``assemble`` and so on.
    tile : (int, int) or None
        Row and column of the tile, from the south-west.
    done, total : int
        Tiles of the stage that are done, and all it has; 0 where it does not go by tiles.
    note : str or None
        What a person should know.
    """

    what: str
    stage: str | None
    tile: tuple[int, int] | None
    done: int
    total: int
    note: str | None


class Teller:
    """Counts what is told, warns of notes, and passes all on."""

    def __init__(self, progress: Callable[[Progress], object] | None) -> None:
        self._progress = progress
        self._done = 0
        self._total = 0

    def __call__(
        self,
        what: str,
        stage: str | None,
        tile: tuple[int, int] | None,
        total: int | None,
        note: str | None,
    ) -> None:
        """Hear one thing."""
        if what == "enter":
            self._done, self._total = 0, total or 0
        elif what in ("done", "kept"):
            self._done += 1
        elif what == "note" and note is not None:
            warnings.warn(note, TiefortWarning, stacklevel=3)
        if self._progress is not None:
            self._progress(Progress(what, stage, tile, self._done, self._total, note))
