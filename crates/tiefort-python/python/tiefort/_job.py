"""Jobs, and what is done with them and with databases."""

from __future__ import annotations

import json
import operator
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Callable, Union

from . import _tiefort
from ._errors import JobError, RequestError
from ._inputs import Path, alone, is_path, path_of, posts_of
from ._mesh import Residual
from ._progress import Progress, Teller
from ._report import Report, residual_of

_BARE = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-")


def _key(key: Any) -> str:
    if not isinstance(key, str):
        raise JobError(f"found a key {key!r} in a job, expected text", "keys of a job are those of a job file")
    return key if key and set(key) <= _BARE else json.dumps(key)


def _value(value: Any) -> str:
    """Return a value as TOML."""
    value = value.item() if hasattr(value, "item") and getattr(value, "shape", None) == () else value
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, (str, os.PathLike)):
        return json.dumps(os.fspath(value), ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, Iterable) and not isinstance(value, (bytes, bytearray)):
        return "[" + ", ".join(map(_value, value)) + "]"
    message = f"found a {type(value).__name__} in a job, expected text, numbers, lists and dictionaries"
    raise JobError(message, "values of a job are those of a job file")


def _toml(job: Mapping[str, Any]) -> str:
    """Return a job as the text of a job file, a key a line."""
    lines = [f"{_key(key)} = {_value(value)}" for key, value in job.items() if not isinstance(value, Mapping)]
    for name, section in job.items():
        if isinstance(section, Mapping):
            lines.append(f"[{_key(name)}]")
            lines += [f"{_key(key)} = {_value(value)}" for key, value in section.items()]
    return "\n".join(lines) + "\n"


class Job:
    """Everything a build needs, read and found good.

    Parameters
    ----------
    job : mapping
        Sections of a job file by name, each a mapping of its keys: ``{"area": {"name": …}, "dem": {…}}``. The page
        ``docs/reference/job-keys.md`` says what they mean. Paths begin at the current folder.

    Raises
    ------
    JobError
        With the key, what was found and what was expected.
    """

    def __init__(self, job: Mapping[str, Any]) -> None:
        if not isinstance(job, Mapping):
            message = f"found a {type(job).__name__} as a job, expected a dictionary"
            raise JobError(message, "Job.load(PATH) reads a job file")
        self._read(_toml(job), "Job(dict)")

    @classmethod
    def load(cls, path: Path) -> Job:
        """Read a job file; paths in it begin at its folder."""
        loaded = cls.__new__(cls)
        loaded._job = _tiefort.Job.load(path_of(path))
        loaded._text, loaded._path = None, path_of(path)
        return loaded

    def _read(self, text: str, path: str) -> None:
        self._job = _tiefort.Job.of_text(text, path)
        self._text: str | None = text
        self._path = path

    def __reduce__(self) -> tuple[Callable[[str | None, str], Job], tuple[str | None, str]]:
        # Another process reads it again.
        return _read_again, (self._text, os.path.abspath(self._path))

    @property
    def name(self) -> str:
        """Name of the area."""
        return self._job.name

    @property
    def settings(self) -> list[tuple[str, str, str]]:
        """Every setting: key, value and meaning, defaults included."""
        return self._job.settings()

    def __repr__(self) -> str:
        return f"Job({self.name!r})"


def _read_again(text: str | None, path: str) -> Job:
    if text is None:
        return Job.load(path)
    job = Job.__new__(Job)
    job._read(text, path)
    return job


AnyJob = Union[Job, Mapping[str, Any], Path]


def _job_of(job: AnyJob) -> Job:
    if isinstance(job, Job):
        return job
    return Job(job) if isinstance(job, Mapping) else Job.load(job)


def _folder(job: Job, out: Path | None) -> str:
    return f"{job.name}.tdb" if out is None else path_of(out)


def _how(workers: int | None, fresh: bool, force: bool, strict: bool, page: bool) -> _tiefort.How:
    if workers is not None:
        workers = operator.index(workers)
        if not 1 <= workers <= 1024:
            message = f"workers: found {workers}, expected 1 to 1024"
            raise RequestError(message, "leave workers out: one for each core")
    return {"workers": workers, "fresh": fresh, "force": force, "strict": strict, "page": page}


def build(
    job: AnyJob,
    out: Path | None = None,
    *,
    workers: int | None = None,
    progress: Callable[[Progress], object] | None = None,
    fresh: bool = False,
    force: bool = False,
    strict: bool = False,
    html: bool = True,
) -> Report:
    """Compile a whole gaming area; what is published and fresh is kept.

    Parameters
    ----------
    job : Job, mapping or path
        What to build.
    out : path, optional
        Folder of the terrain database; ``NAME.tdb`` here, NAME being the area's, unless given.
    workers : int, optional
        Tiles at once; as many as cores and memory allow unless given.
    progress : callable, optional
        Called with a `Progress` for everything that happens. What it raises ends the build, which goes on from there
        when it is asked for again.
    fresh : bool
        Keep nothing of an earlier build.
    force : bool
        Build even where memory or disk are forecast not to suffice.
    strict : bool
        Judge sources as ``--strict`` does.
    html : bool
        Whether to draw ``report.html``.

    Returns
    -------
    Report
        Also where limits could not be met: ``report.breaches`` says which.

    Raises
    ------
    JobError, SourceError, RequestError, DatabaseError
        When there is nothing to build.
    BusyError
        When another build is at work in the folder.
    """
    read = _job_of(job)
    how = _how(workers, fresh, force, strict, html)
    text, rebuilt, kept, unchanged = _tiefort.build(read._job, _folder(read, out), how, Teller(progress))
    return Report(text, rebuilt=rebuilt, kept=kept, unchanged=unchanged)


def tile(
    job: AnyJob,
    tile: tuple[int, int],
    out: Path | None = None,
    *,
    release_borders: bool = False,
    workers: int | None = None,
    progress: Callable[[Progress], object] | None = None,
    force: bool = False,
    strict: bool = False,
    html: bool = True,
) -> Report:
    """Make one tile again, its row and column counted from the south-west.

    With `release_borders`, what a changed border reaches is made again, too; the rest as for `build`.
    """
    read = _job_of(job)
    how = _how(workers, False, force, strict, html)
    try:
        row, col = (operator.index(number) for number in tile)
    except (TypeError, ValueError):
        raise RequestError(f"tile: found {tile!r}, expected its row and column", "as (2, 3)") from None
    text, tiles = _tiefort.tile(read._job, (row, col), _folder(read, out), release_borders, how, Teller(progress))
    return Report(text, rebuilt=len(tiles))


def plan(job: AnyJob) -> dict[str, Any]:
    """Return what a build would take, before any work: tiles, triangles, memory, disk and seconds.

    The keys are those of ``tiefort plan --emit json``.
    """
    found: dict[str, Any] = json.loads(_tiefort.plan(_job_of(job)._job))
    return found


@dataclass(frozen=True)
class Verdict:
    """Whether a database is sound.

    Attributes
    ----------
    problems : list of str
        What is wrong, a sentence each; empty for a sound one.
    unchecked : list of str
        What could not be checked, and why.
    checked_files, checked_modules : int
        Files and load modules that were checked.
    residual : Residual or None
        Against the raster that was given.
    """

    problems: list[str]
    unchecked: list[str]
    checked_files: int
    checked_modules: int
    residual: Residual | None

    @property
    def sound(self) -> bool:
        """Whether there is no problem."""
        return not self.problems


def verify(database: Path, dem: Path | None = None) -> Verdict:
    """Check every file and every load module of a database; with `dem`, measure residuals against that raster."""
    found = _tiefort.verify(path_of(database), None if dem is None else path_of(dem))
    residual = found.pop("residual")
    return Verdict(residual=None if residual is None else residual_of(residual), **found)


def _module_words(modules: Any) -> str:
    if isinstance(modules, str):
        return modules
    first, last = modules if isinstance(modules[0], Iterable) else (modules, modules)
    return f"{first[0]},{first[1]}..{last[0]},{last[1]}"


def export(
    database: Path,
    out: Path,
    *,
    format: str,
    modules: Any = None,
    lod: int | None = None,
    coordinates: str | None = None,
    layer: str | None = None,
    against: Path | None = None,
    assume_datum: str | float | None = None,
    workers: int | None = None,
) -> str:
    """Write a finished database in another program's format, with the bytes of ``tiefort export``.

    Parameters
    ----------
    database, out : path
        The terrain database; and the file, or the folder, to write.
    format : str
        ``modules``, ``ply``, ``obj``, ``glb``, ``geotiff``, ``gpkg``, ``features``, ``openflight``, ``3dtiles``,
        ``3tz``, ``3dtiles-terrain``, ``quantized-mesh``, ``mbtiles``, ``terrain-rgb``, ``usd``, ``heightmap``,
        ``gazebo``.
    modules : (row, col), ((row, col), (row, col)) or str, optional
        One load module, or the south-western and the north-eastern one of a block.
    lod, coordinates, layer, against, assume_datum, workers
        As the command line has them.

    Returns
    -------
    str
        What was exported, in words.
    """
    words = [path_of(database), f"--format={format}", f"--out={path_of(out)}"]
    if modules is not None:
        words.append(f"--modules={_module_words(modules)}")
    named = (("lod", lod), ("coordinates", coordinates), ("layer", layer), ("assume-datum", assume_datum))
    words += [f"--{name}={value}" for name, value in named if value is not None]
    if against is not None:
        words.append(f"--against={path_of(against)}")
    if workers is not None:
        words.append(f"--workers={operator.index(workers)}")
    return _tiefort.export(words)


def compare(
    ground: Any,
    *,
    points: Iterable[int] = (2500, 5000),
    methods: Iterable[str] = (),
    start: Iterable[str] = (),
    window: str | None = None,
    crs: Any = None,
    transform: Any = None,
    spacing_m: float | None = None,
    nodata: float | None = None,
) -> dict[str, Any]:
    """Compare methods on heights: points, residuals, equivalent points, seconds.

    Heights are the path of a raster or of a job, or what `tin` takes: an array, a DataArray, a rasterio dataset, with
    ``crs``, ``transform``, ``spacing_m`` and ``nodata`` as there. Other arguments, and keys, are those of ``tiefort
    compare --format json``.
    """
    words = ["--points=" + ",".join(str(operator.index(number)) for number in points)]
    for name, chosen in (("methods", list(methods)), ("start", list(start))):
        if chosen:
            words.append(f"--{name}={','.join(chosen)}")
    if window is not None:
        words.append(f"--window={window}")
    told: dict[str, Any]
    if is_path(ground):
        alone(crs, transform, spacing_m, nodata)
        told = json.loads(_tiefort.compare([path_of(ground), *words]))
    else:
        posts = posts_of(ground, crs, transform, spacing_m, nodata)
        told = json.loads(_tiefort.compare_on_array(posts.array, posts.placed, ["array", *words]))
    return told


def correlate(
    a: Path,
    b: Path,
    *,
    accept: float = 0.95,
    risk: float = 0.05,
    within_m: float = 1.0,
    slope_within_degrees: float = 5.0,
    samples: int | None = None,
    range_m: float = 3000.0,
    objects: str = "all",
    seed: int = 1,
    allow_datums: bool = False,
    page: Path | None = None,
) -> dict[str, Any]:
    """Tell how well two databases, or a database and a raster of heights, agree: for a fair fight of two simulators.

    Keys are those of ``tiefort correlate --format json``: ``accepted`` and ``causes`` first of all. With ``page``, the
    certificate is also written there, as HTML.
    """
    words = [
        path_of(a),
        path_of(b),
        f"--accept={accept}",
        f"--risk={risk}",
        f"--within={within_m}",
        f"--slope-within={slope_within_degrees}",
        f"--range={range_m}",
        f"--objects={objects}",
        f"--seed={operator.index(seed)}",
    ]
    if samples is not None:
        words.append(f"--samples={operator.index(samples)}")
    if allow_datums:
        words.append("--allow-datums")
    if page is not None:
        words.append(f"--page={path_of(page)}")
    told: dict[str, Any] = json.loads(_tiefort.correlate(words))
    return told
