"""What can go wrong, by name; the words are those of the command line."""

from __future__ import annotations


class TiefortError(Exception):
    """Why something could not be done.

    Attributes
    ----------
    message : str
        What was found, and what was expected.
    hint : str
        What could be done about it.
    """

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message, hint)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message}\nhint: {self.hint}" if self.hint else self.message


class RequestError(TiefortError, ValueError):
    """What was asked for cannot be."""


class JobError(TiefortError, ValueError):
    """A job is wrong."""


class SourceError(TiefortError, ValueError):
    """A raster, an array or another source cannot be used."""


class DatabaseError(TiefortError):
    """A terrain database cannot be read or written, or is none."""


class ClosedError(DatabaseError):
    """A database was asked after it was closed."""


class BusyError(DatabaseError):
    """Another build is at work there: the same may do later."""


class OutputError(TiefortError):
    """A file or a folder cannot be written."""


class StoppedError(TiefortError):
    """A run was asked to stop."""


class InternalError(TiefortError):
    """The package is wrong; please report it."""


class TiefortWarning(UserWarning):
    """What a person should know about heights, or about what was done to have them."""
