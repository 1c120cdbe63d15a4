"""Arrays in, meshes out."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tiefort
from conftest import hills, run


def test_a_mesh_has_what_was_asked_for_and_stands_where_the_array_does() -> None:
    mesh = tiefort.tin(hills(), triangles=500, spacing_m=25.0)
    assert len(mesh.triangles) <= 500 and mesh.triangles.dtype == np.uint32 and mesh.triangles.shape[1] == 3
    assert mesh.vertices.dtype == np.float64 and mesh.vertices.shape[1] == 3
    assert mesh.vertices[:, :2].min(axis=0).tolist() == [0, 0]
    assert mesh.vertices[:, :2].max(axis=0).tolist() == [159 * 25, 119 * 25]
    assert mesh.crs is None and mesh.transform == (25.0, 0.0, -12.5, 0.0, -25.0, 119 * 25 + 12.5)
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0, 2] += 10
    assert not mesh.triangles.flags.writeable and mesh.vertices.copy().flags.writeable
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]] for corner in range(3))
    cross = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    assert (0 < cross).all() and cross.sum() / 2 == pytest.approx(159 * 119 * 625)


def test_residuals_are_those_of_the_mesh_at_the_posts() -> None:
    dem = hills()
    mesh = tiefort.tin(dem, points=300, method="greedy", spacing_m=25.0)
    rows, cols = np.mgrid[0 : dem.shape[0], 0 : dem.shape[1]]
    places = np.stack((cols * 25.0, (dem.shape[0] - 1 - rows) * 25.0), axis=-1)
    residual = mesh.sample(places) - dem
    assert np.sqrt((residual**2).mean()) == pytest.approx(mesh.residual.rms_m, abs=0.01)
    assert np.abs(residual).max() == pytest.approx(mesh.residual.max_m, abs=0.02)
    assert np.isnan(mesh.sample([[-1.0, 0.0], [np.nan, 5.0], [1e300, 0.0]])).all()


def test_equal_heights_make_equal_meshes_whatever_holds_them() -> None:
    whole = np.round(hills())
    reference = tiefort.tin(whole, triangles=300)
    big_endian = whole.astype(">f4")
    forms: list[Any] = [
        *(whole.astype(dtype) for dtype in ("f8", "i2", "i4", "u1", "u2", "i8", ">i2", ">f8")),
        big_endian,
        np.asfortranarray(whole),
        np.repeat(whole, 3, axis=1)[:, ::3],
        whole[::-1, ::-1].copy()[::-1, ::-1],
        np.ma.MaskedArray(whole),
        whole.tolist(),
    ]
    unaligned = np.frombuffer(b"x" + whole.tobytes(), np.uint8)[1:].view(np.float32).reshape(whole.shape)
    for form in [*forms, unaligned]:
        mesh = tiefort.tin(form, triangles=300)
        assert np.array_equal(mesh.vertices, reference.vertices)
        assert np.array_equal(mesh.triangles, reference.triangles)


def test_rows_from_the_south_are_turned_by_their_transform() -> None:
    dem = hills()
    north = tiefort.tin(dem, triangles=300, transform=(10, 0, 500, 0, -10, 9000), crs=32611)
    south = tiefort.tin(dem[::-1], triangles=300, transform=(10, 0, 500, 0, 10, 9000 - 10 * len(dem)), crs=32611)
    assert np.array_equal(north.vertices, south.vertices) and north.crs == "EPSG:32611"
    assert north.transform == (10, 0, 500, 0, -10, 9000)


def test_nan_and_nodata_are_void() -> None:
    dem = hills()
    dem[40:60, 50:70] = np.nan
    marked = np.where(np.isnan(dem), np.float32(-9999), dem)
    masked = np.ma.masked_equal(marked, -9999)
    meshes = [tiefort.tin(dem, triangles=300), tiefort.tin(marked, triangles=300, nodata=-9999)]
    meshes.append(tiefort.tin(masked, triangles=300))
    assert all(np.array_equal(meshes[0].vertices, mesh.vertices) for mesh in meshes)
    assert meshes[0].residual.max_m < 60


def test_files_have_the_bytes_of_the_command_line(tmp_path: Path) -> None:
    raster = tmp_path / "dem.tif"
    assert run("sample", "--out", raster).returncode == 0
    ends = {"triangles": 2000}
    mesh = tiefort.tin(raster, **ends)
    for name, words in (("a.ply", []), ("b.obj", []), ("c.glb", []), ("d.ply", ["--coordinates", "map"])):
        ours, theirs = tmp_path / f"ours-{name}", tmp_path / f"theirs-{name}"
        mesh.save(ours, coordinates="map" if words else "local")
        done = run("tin", raster, "--triangles", 2000, *words, "--out", theirs)
        assert done.returncode == 0, done.stderr
        assert ours.read_bytes() == theirs.read_bytes(), name


def test_an_array_makes_the_bytes_of_its_file(tmp_path: Path) -> None:
    rasterio = pytest.importorskip("rasterio")
    dem = hills()
    dem[3:9, 30:35] = -9999
    transform = rasterio.Affine(25, 0, 505_000, 0, -25, 3_900_000)
    path = tmp_path / "dem.tif"
    about = {"driver": "GTiff", "height": dem.shape[0], "width": dem.shape[1], "count": 1, "dtype": "float32"}
    with rasterio.open(path, "w", crs="EPSG:32611", transform=transform, nodata=-9999, **about) as out:
        out.write(dem, 1)
    done = run("tin", path, "--triangles", 700, "--coordinates", "map", "--out", tmp_path / "theirs.ply")
    assert done.returncode == 0, done.stderr
    with rasterio.open(path) as dataset:
        forms = {
            "array": tiefort.tin(dem, 700, crs="EPSG:32611", transform=transform, nodata=-9999),
            "dataset": tiefort.tin(dataset, 700),
            "path": tiefort.tin(path, 700),
            "bytes": tiefort.tin(str(path).encode(), 700),
        }
    with pytest.raises(tiefort.SourceError, match="closed"):
        tiefort.tin(dataset, 700)
    for name, mesh in forms.items():
        mesh.save(tmp_path / "ours.ply", coordinates="map")
        assert (tmp_path / "ours.ply").read_bytes() == (tmp_path / "theirs.ply").read_bytes(), name


def test_a_data_array_brings_its_place() -> None:
    xarray = pytest.importorskip("xarray")
    dem = hills()
    y, x = 9000 - 10 * np.arange(dem.shape[0]), 500 + 10.0 * np.arange(dem.shape[1])
    array = xarray.DataArray(dem[None], {"band": [1], "y": y, "x": x}, ("band", "y", "x"), attrs={"crs": "EPSG:32611"})
    mesh = tiefort.tin(array, triangles=300)
    assert mesh.crs == "EPSG:32611" and mesh.transform == (10, 0, 495, 0, -10, 9005)
    assert np.array_equal(mesh.vertices, tiefort.tin(array[:, ::-1], triangles=300).vertices)
    with pytest.raises(tiefort.SourceError, match="evenly"):
        tiefort.tin(array.assign_coords(x=x**1.01), triangles=300)


def test_degrees_are_resampled_to_metres_and_that_is_told() -> None:
    step = 1 / 3600
    with pytest.warns(tiefort.TiefortWarning, match="resampled from posts 1 x 1 seconds"):
        mesh = tiefort.tin(hills(), triangles=300, transform=(step, 0, -116, 0, -step, 35), crs=4326)
    assert mesh.crs == "EPSG:32611" and 3_800_000 < mesh.vertices[0, 1] < 3_900_000


@pytest.mark.parametrize(
    ("dem", "kind", "words"),
    [
        (np.zeros(5), tiefort.SourceError, "1 dimensions"),
        (np.zeros((2, 3, 4)), tiefort.SourceError, "3 dimensions (2 x 3 x 4), expected 2"),
        (np.float64(3), tiefort.SourceError, "0 dimensions"),
        (np.zeros((0, 5)), tiefort.SourceError, "0 x 5 posts"),
        (np.zeros((5, 0)), tiefort.SourceError, "5 x 0 posts"),
        (np.zeros((1, 5)), tiefort.RequestError, "1 x 5 posts, expected at least 2 x 2 posts"),
        (np.zeros((5, 1)), tiefort.RequestError, "5 x 1 posts, expected at least 2 x 2 posts"),
        (hills().astype(complex), tiefort.SourceError, "complex128, expected float32"),
        (hills().astype(object), tiefort.SourceError, "object, expected float32"),
        (hills() > 100, tiefort.SourceError, "bool, expected float32"),
        (np.full((4, 4), "a"), tiefort.SourceError, "expected float32"),
        (None, tiefort.SourceError, "0 dimensions"),
        (np.full((9, 9), np.nan), tiefort.SourceError, "81"),
        (np.full((9, 9), np.inf), tiefort.SourceError, "infinite height at"),
        (np.where(hills() < 50, -np.inf, hills()), tiefort.SourceError, "infinite height at"),
        (np.full((9, 9), 1e9), tiefort.SourceError, "a height of 1000000000 m"),
    ],
)
def test_arrays_that_hold_no_ground_are_refused(dem: Any, kind: type[tiefort.TiefortError], words: str) -> None:
    with pytest.raises(kind) as raised:
        tiefort.tin(dem, points=50)
    assert words in raised.value.message and raised.value.hint and "hint: " in str(raised.value)


@pytest.mark.parametrize(
    ("ends", "words"),
    [
        ({}, "a value for one of points, triangles, max_residual_m, rms_m"),
        ({"triangles": 1}, 'triangles: found "1", expected 2 or more'),
        ({"triangles": -5}, 'triangles: found "-5", expected 2 or more'),
        ({"triangles": 10, "tiles": (3, 3)}, "triangles: 10, expected at least 18, two in each tile"),
        ({"points": 10, "tiles": (3, 3)}, "points: 10, expected at least the 16 corners"),
        ({"points": 3}, 'points: found "3", expected 4 or more'),
        ({"points": 50, "triangles": 50}, "expected one of them"),
        ({"rms_m": -1}, "rms_m"),
        ({"max_residual_m": float("nan")}, "max_residual_m"),
        ({"points": 50, "method": "delaunay"}, "delaunay"),
        ({"points": 50, "effort": "most"}, "most"),
        ({"points": 50, "tiles": "6"}, "tiles"),
        ({"points": 50, "workers": 0}, "workers"),
        ({"points": 50, "crs": "EPSG:1", "spacing_m": 1}, "crs: found"),
        ({"points": 50, "crs": "EPSG:32611"}, "without a transform"),
        ({"points": 50, "crs": object(), "spacing_m": 1}, "crs: found object"),
        ({"points": 50, "spacing_m": 0}, "spacing_m: found 0"),
        ({"points": 50, "transform": (1, 0, 0)}, "expected six numbers"),
        ({"points": 50, "transform": (1, 0.5, 0, 0, -1, 0)}, "turned"),
        ({"points": 50, "transform": (1, 0, 0, 0, -2, 0)}, "no crs"),
        ({"points": 50, "transform": (1, 0, float("nan"), 0, -1, 0)}, "finite"),
        ({"points": 50, "transform": (-1, 0, 0, 0, -1, 0)}, "above 0"),
        ({"points": 50, "start": "vpi:10"}, "vip"),
    ],
)
def test_what_cannot_be_is_refused_in_the_words_of_the_command_line(ends: dict[str, Any], words: str) -> None:
    with pytest.raises(tiefort.RequestError) as raised:
        tiefort.tin(hills(), **ends)
    assert words in raised.value.message, raised.value.message
    assert "--" not in raised.value.message, "arguments have no dashes here"
    assert isinstance(raised.value, ValueError)


def test_a_missing_file_is_told_as_by_the_command_line(tmp_path: Path) -> None:
    missing = tmp_path / "missing.tif"
    with pytest.raises(tiefort.SourceError) as raised:
        tiefort.tin(missing, points=50)
    done = run("tin", missing, "--points", 50, "--out", tmp_path / "a.ply")
    told = f"error: {raised.value.message} hint: {raised.value.hint}"
    assert " ".join(done.stderr.split()) == " ".join(told.split())
    with pytest.raises(tiefort.RequestError, match="found crs with a path"):
        tiefort.tin(missing, points=50, crs=4326)


def test_what_is_wrong_is_told_in_the_words_of_the_function() -> None:
    for wrong in ({"effort": "bset"}, {"method": "papr"}, {"tiles": "3y3"}, {"key": "min"}, {"triangles": 1}):
        with pytest.raises(tiefort.RequestError) as raised:
            tiefort.tin(hills(), **wrong, **({} if "triangles" in wrong else {"points": 50}))
        (name,) = wrong
        assert str(raised.value).startswith(f"{name}: found"), raised.value
        assert not any(part in str(raised.value) for part in ("--", "Usage", "<")), raised.value


def test_voids_stay_holes() -> None:
    ground = hills(dtype=np.float64)
    rows, cols = ground.shape
    ground[rows // 4 : rows // 2, cols // 4 : cols // 2] = np.nan
    mesh = tiefort.tin(ground, points=400)
    inside = [[cols * 0.375, rows * 0.625]]
    assert np.isnan(mesh.sample(inside)).all()
    assert np.isfinite(mesh.sample([[cols * 0.8, rows * 0.2]])).all()
    assert np.array_equal(np.unique(mesh.triangles), np.arange(len(mesh.vertices)))
    corners = mesh.vertices[mesh.triangles][:, :, :2]
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    covered = (one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]).sum() / 2
    whole = (rows - 1) * (cols - 1)
    void = (rows // 4) * (cols // 4)
    assert abs(whole - covered - void) < void / 4


def test_the_package_says_its_version() -> None:
    assert tiefort.__version__.count(".") == 2 and "__version__" in dir(tiefort)


def test_meshes_are_written_whole_or_not_at_all(tmp_path: Path) -> None:
    mesh = tiefort.tin(hills(), points=50)
    with pytest.raises(tiefort.OutputError, match="cannot be written"):
        mesh.save(tmp_path / "no" / "folder.ply")
    with pytest.raises(tiefort.RequestError, match="extension"):
        mesh.save(tmp_path / "mesh.xyz")
    with pytest.raises(tiefort.RequestError, match="map coordinates"):
        mesh.save(tmp_path / "mesh.glb", coordinates="map")
    assert not list(tmp_path.iterdir())
    odd = bytes(tmp_path) + b"/mesh-\xff.ply"
    mesh.save(odd)
    assert [path.name for path in tmp_path.iterdir()] == ["mesh-\udcff.ply"]


def test_progress_is_told_and_what_a_callback_raises_ends_the_run() -> None:
    told: list[tiefort.Progress] = []
    tiefort.tin(hills(), triangles=300, tiles=(2, 2), progress=told.append)
    done = [told.done for told in told if told.what == "done" and told.stage == "refine"]
    assert done == [1, 2, 3, 4] and told[-1].what == "leave"

    class Enough(Exception):
        pass

    def enough(progress: tiefort.Progress) -> None:
        raise Enough

    with pytest.raises(Enough):
        tiefort.tin(hills(), triangles=300, progress=enough)


def test_a_warning_may_be_made_an_error() -> None:
    dem = hills()
    dem[5, 5] = -9999
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(tiefort.TiefortWarning, match="beyond any land"):
            tiefort.tin(dem, triangles=300)


def test_other_threads_run_meanwhile() -> None:
    counted, ends = 0, threading.Event()

    def count() -> None:
        nonlocal counted
        while not ends.wait(0.005):
            counted += 1

    thread = threading.Thread(target=count)
    thread.start()
    started = time.monotonic()
    tiefort.tin(hills(900, 900), triangles=20_000, effort="best")
    took = time.monotonic() - started
    ends.set()
    thread.join()
    assert 20 * took < counted, (took, counted)


def test_ctrl_c_ends_within_a_second(tmp_path: Path) -> None:
    program = """
import os, signal, sys, threading, time, numpy, tiefort
# A shell that runs this in the background lets it ignore the signal.
signal.signal(signal.SIGINT, signal.default_int_handler)
row, col = numpy.mgrid[0:3000, 0:3000]
dem = (100 * numpy.sin(row / 17) * numpy.cos(col / 23)).astype(numpy.float32)
sent = []
def send():
    sent.append(time.monotonic())
    os.kill(os.getpid(), signal.SIGINT)
threading.Timer(1.0, send).start()
try:
    tiefort.tin(dem, triangles=500_000, effort="best")
except KeyboardInterrupt:
    print(time.monotonic() - sent[0])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and done.stdout, done.stderr
    assert float(done.stdout) < 1.0, done.stdout


def test_meshes_go_to_other_packages() -> None:
    mesh = tiefort.tin(hills(), triangles=300, transform=(10, 0, 500, 0, -10, 9000), crs=32611)
    tried = 0
    for name, convert in (
        ("trimesh", lambda: len(mesh.to_trimesh().faces)),
        ("pyvista", lambda: mesh.to_pyvista().n_cells),
        ("meshio", lambda: len(mesh.to_meshio().cells[0].data)),
        ("geopandas", lambda: len(mesh.to_geopandas())),
    ):
        try:
            __import__(name)
        except ImportError:
            with pytest.raises(ImportError, match=name):
                convert()
            continue
        assert convert() == len(mesh.triangles), name
        tried += 1
    print(f"{tried} of 4 packages tried")


def test_meshes_can_be_pickled() -> None:
    import pickle

    mesh = tiefort.tin(hills(), triangles=50)
    again = pickle.loads(pickle.dumps(mesh))
    assert np.array_equal(again.vertices, mesh.vertices) and again.residual == mesh.residual
    places = mesh.vertices[:5, :2] + 0.25
    assert np.allclose(again.sample(places), mesh.sample(places), equal_nan=True)
    with pytest.raises(tiefort.RequestError, match="not made here"):
        again.save("mesh.ply")


def test_failures_can_be_pickled() -> None:
    import pickle

    failure = pickle.loads(pickle.dumps(tiefort.RequestError("found a, expected b", "c")))
    assert (failure.message, failure.hint, str(failure)) == ("found a, expected b", "c", "found a, expected b\nhint: c")
