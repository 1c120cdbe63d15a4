"""Jobs built, databases asked."""

from __future__ import annotations

import filecmp
import json
import multiprocessing
import os
import pickle
import shutil
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tiefort
from conftest import JOB, hills, run


def files_of(folder: Path) -> list[str]:
    kinds = ("modules", "tiles", "database.json")
    return sorted(
        str(path.relative_to(folder))
        for kind in kinds
        for path in ([folder / kind] if (folder / kind).is_file() else (folder / kind).rglob("*"))
        if path.is_file()
    )


def test_a_build_has_the_bytes_of_the_command_line(database: Path, tmp_path: Path) -> None:
    job = tmp_path / "small.toml"
    job.write_text(
        '[area]\nname = "small"\ncrs = "EPSG:32611"\norigin_m = [505000, 3875000]\nsize_m = [4000, 3000]\n'
        'spacing_m = 25\n[dem]\nsource = "sample"\n[tiles]\nrows = 2\ncolumns = 2\n'
    )
    done = run("build", job, "--out", tmp_path / "theirs.tdb", "--quiet")
    assert done.returncode in (0, 1), done.stderr
    names = files_of(database)
    assert names == files_of(tmp_path / "theirs.tdb") and 8 < len(names)
    same = filecmp.cmpfiles(database, tmp_path / "theirs.tdb", names, shallow=False)
    assert same == (names, [], [])
    assert tiefort.Job.load(job).settings[:2] == tiefort.Job(JOB).settings[:2]


def test_a_report_says_what_was_found_and_a_second_build_does_nothing(database: Path) -> None:
    told: list[tiefort.Progress] = []
    report = tiefort.build(JOB, database, progress=told.append)
    assert report.unchanged and report.area == "small" and 0 < report.triangles
    assert report.residual.rms_m < 5 and report.per_load_module["max"] <= report.per_load_module["limit"]
    with tiefort.open(database) as opened:
        assert opened.report.residual == report.residual


def test_progress_of_a_build_is_told_tile_by_tile(tmp_path: Path) -> None:
    told: list[tiefort.Progress] = []
    report = tiefort.build(JOB, tmp_path / "a.tdb", workers=1, progress=told.append, html=False)
    refined = [progress for progress in told if progress.what == "done" and progress.stage == "refine"]
    assert [progress.done for progress in refined] == [1, 2, 3, 4] and {progress.total for progress in refined} == {4}
    assert (report.tiles_rebuilt, report.tiles_kept) == (4, 0)
    assert {"refine", "assemble", "publish"} <= {progress.stage for progress in told}
    assert "refine" in report.seconds and not (tmp_path / "a.tdb" / "report.html").exists()


def test_a_callback_that_raises_ends_a_build_which_goes_on_later(tmp_path: Path) -> None:
    def enough(progress: tiefort.Progress) -> None:
        if progress.what == "done" and progress.stage == "refine":
            raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        tiefort.build(JOB, tmp_path / "a.tdb", workers=1, progress=enough)
    with pytest.raises(tiefort.DatabaseError, match="incomplete"):
        tiefort.open(tmp_path / "a.tdb")
    assert tiefort.build(JOB, tmp_path / "a.tdb").ok is not None
    assert tiefort.verify(tmp_path / "a.tdb").sound


def test_after_ctrl_c_a_build_goes_on_at_once(tmp_path: Path) -> None:
    # One tile, which goes on for longer than a run is waited for.
    area = {**JOB["area"], "size_m": [12_000, 12_000]}
    job = {**JOB, "area": area, "tiles": {"rows": 1, "columns": 1}, "tin": {"effort": "best"}}
    program = f"""
import os, signal, threading, tiefort
signal.signal(signal.SIGINT, signal.default_int_handler)
sent = []
def send(progress):
    if progress.what == "started" and progress.stage == "refine" and not sent:
        sent.append(threading.Timer(0.01, os.kill, (os.getpid(), signal.SIGINT)))
        sent[0].start()
job, out = {job!r}, {str(tmp_path / "a.tdb")!r}
try:
    tiefort.build(job, out, workers=1, html=False, progress=send)
except KeyboardInterrupt:
    print("interrupted")
print(tiefort.build(job, out, workers=1, html=False).ok)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and done.stdout.startswith("interrupted"), done.stderr


def test_two_builds_in_one_folder_and_the_second_is_told_to_wait(tmp_path: Path) -> None:
    refused: list[tiefort.BusyError] = []

    def second(progress: tiefort.Progress) -> None:
        if progress.what == "enter" and progress.stage == "refine":
            with pytest.raises(tiefort.BusyError) as raised:
                tiefort.build(JOB, tmp_path / "a.tdb")
            refused.append(raised.value)

    tiefort.build(JOB, tmp_path / "a.tdb", progress=second)
    assert len(refused) == 1 and refused[0].hint and "a.tdb" in refused[0].message


def _mesh_in_child(results: Any) -> None:
    results.put(len(tiefort.tin(hills(), triangles=200).triangles))


@pytest.mark.parametrize("way", ["fork", "spawn"])
def test_processes_are_started_while_building(way: Any, tmp_path: Path) -> None:
    context = multiprocessing.get_context(way)
    results = context.Queue()
    children: list[Any] = []

    def start(progress: tiefort.Progress) -> None:
        if progress.what == "done" and progress.stage == "refine" and not children:
            children.append(context.Process(target=_mesh_in_child, args=(results,)))
            children[0].start()

    tiefort.build(JOB, tmp_path / "a.tdb", workers=2, progress=start)
    # The child may hold the lock's file open; that must not keep others out.
    tiefort.build(JOB, tmp_path / "a.tdb", fresh=True)
    assert 190 < results.get(timeout=120) <= 200
    children[0].join(60)
    assert children[0].exitcode == 0
    assert tiefort.verify(tmp_path / "a.tdb").sound


def test_builds_in_threads_do_not_disturb_each_other(tmp_path: Path) -> None:
    folders = [tmp_path / f"{number}.tdb" for number in range(3)]
    threads = [threading.Thread(target=tiefort.build, args=(JOB, folder)) for folder in folders]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    names = files_of(folders[0])
    assert filecmp.cmpfiles(folders[0], folders[1], names, shallow=False)[0] == names


@pytest.mark.parametrize(
    ("job", "words"),
    [
        ({}, "area"),
        ({**JOB, "area": {**JOB["area"], "crs": "EPSG:4326"}}, "crs"),
        ({**JOB, "tin": {"methd": "paper"}}, "methd"),
        ({**JOB, "dem": {"sources": ["missing.tif"]}}, "missing.tif"),
        ({**JOB, "limits": {"per_load_module": object()}}, "object"),
        ({1: {}}, "key 1"),
        ([], "list"),
    ],
)
def test_jobs_that_are_wrong_are_refused(job: Any, words: str) -> None:
    with pytest.raises(tiefort.JobError) as raised:
        tiefort.Job(job)
    assert words in raised.value.message and raised.value.hint


def test_a_job_of_any_text_is_read_as_it_was_given() -> None:
    name = 'a "b" \\ \x7f ü'
    with pytest.raises(tiefort.JobError) as raised:
        tiefort.Job({**JOB, "dem": {"sources": [name]}})
    assert "ü" in raised.value.message


def test_plan_tile_verify_and_explain(database: Path, tmp_path: Path) -> None:
    for wrong in ("0,0", (0, 0, 0), 3):
        with pytest.raises(tiefort.RequestError, match="expected its row and column"):
            tiefort.tile(JOB, wrong, tmp_path / "none.tdb")  # type: ignore[arg-type]
    plan = tiefort.plan(JOB)
    assert len(plan["tiles"]) == 4 and 0 < plan["forecast"]["memory_bytes"]
    copy = tmp_path / "copy.tdb"
    shutil.copytree(database, copy)
    report = tiefort.tile(JOB, (1, 1), copy)
    assert report.tiles_rebuilt == 1
    names = files_of(database)
    names.remove("database.json")
    assert filecmp.cmpfiles(database, copy, names, shallow=False)[0] == names
    with pytest.raises(tiefort.RequestError, match="no tile 7,7"):
        tiefort.tile(JOB, (7, 7), copy)
    verdict = tiefort.verify(copy)
    assert verdict.sound and verdict.checked_modules == 48
    next((copy / "modules").iterdir()).write_bytes(b"broken")
    assert not tiefort.verify(copy).sound
    with tiefort.open(database) as opened:
        ours = opened.explain(2, 3)
    theirs = run("explain", database, "2,3", "--format", "json")
    assert ours == json.loads(theirs.stdout)


def test_exports_have_the_bytes_of_the_command_line(database: Path, tmp_path: Path) -> None:
    told = tiefort.export(database, tmp_path / "ours.glb", format="glb", modules=((0, 0), (2, 2)))
    assert "9 load modules" in told
    done = run("export", database, "--format", "glb", "--modules", "0,0..2,2", "--out", tmp_path / "theirs.glb")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "ours.glb").read_bytes() == (tmp_path / "theirs.glb").read_bytes()
    with pytest.raises(tiefort.RequestError, match="extension"):
        tiefort.export(database, tmp_path / "a.tif", format="glb")
    with pytest.raises(tiefort.RequestError, match='format: found "xyz", expected one of modules'):
        tiefort.export(database, tmp_path / "a.xyz", format="xyz")


def test_methods_are_compared(tmp_path: Path) -> None:
    assert run("sample", "--out", tmp_path / "dem.tif").returncode == 0
    found = tiefort.compare(tmp_path / "dem.tif", points=[100], methods=["regular", "iterative"])
    assert [row["method"] for row in found["rows"]] == ["regular", "iterative"]
    with pytest.raises(tiefort.RequestError, match="found crs with a path"):
        tiefort.compare(tmp_path / "dem.tif", crs="EPSG:32611")


def test_a_database_agrees_with_itself(database: Path, tmp_path: Path) -> None:
    found = tiefort.correlate(database, database, range_m=500, page=tmp_path / "certificate.html")
    assert found["accepted"] and found["heights"]["largest_m"] == 0 and found["causes"] == []
    assert "BLAKE3" in (tmp_path / "certificate.html").read_text(encoding="utf-8")
    with pytest.raises(tiefort.RequestError, match="samples: 20, expected 59 at least"):
        tiefort.correlate(database, database, samples=20)


def without_seconds(found: dict[str, Any]) -> list[dict[str, Any]]:
    return [{key: value for key, value in row.items() if key != "seconds"} for row in found["rows"]]


def test_methods_are_compared_on_heights_in_memory(tmp_path: Path) -> None:
    asked: dict[str, Any] = {"points": [100], "methods": ["regular", "iterative"]}
    found = tiefort.compare(hills(), spacing_m=25.0, **asked)
    assert [row["method"] for row in found["rows"]] == ["regular", "iterative"]
    again = tiefort.compare(hills().astype(np.float64), spacing_m=25.0, **asked)
    assert without_seconds(found) == without_seconds(again)
    part = tiefort.compare(hills(), spacing_m=25.0, window="10,20,30x40", **asked)
    assert without_seconds(part) != without_seconds(found)
    with pytest.raises(tiefort.RequestError, match="points"):
        tiefort.compare(hills(), points=[])
    rasterio = pytest.importorskip("rasterio")
    assert run("sample", "--posts", 301, "--out", tmp_path / "dem.tif").returncode == 0
    with rasterio.open(tmp_path / "dem.tif") as dataset:
        held = tiefort.compare(dataset, **asked)
    assert without_seconds(held) == without_seconds(tiefort.compare(tmp_path / "dem.tif", **asked))


def test_a_database_answers_for_heights_normals_and_classes(database: Path) -> None:
    with tiefort.open(database) as opened:
        assert (opened.crs, opened.shape, opened.levels) == ("EPSG:32611", (6, 8), 1)
        assert opened.bounds == (505_000, 3_875_000, 509_000, 3_878_000)
        rng = np.random.default_rng(7)
        places = np.column_stack((rng.uniform(505_000, 509_000, 500), rng.uniform(3_875_000, 3_878_000, 500)))
        heights = opened.heights(places)
        assert heights.shape == (500,) and np.isfinite(heights).all()
        assert opened.heights(places[0]).shape == () and opened.heights(places.reshape(5, 100, 2)).shape == (5, 100)
        normals = opened.normals(places)
        assert np.allclose(np.linalg.norm(normals, axis=1), 1) and (0 < normals[:, 2]).all()
        assert (opened.classes(places) == 0).all()
        # A step of a centimetre along the slope.
        east = opened.heights(places + np.array([0.01, 0.0])) - heights
        flat = np.abs(east + 0.01 * normals[:, 0] / normals[:, 2]) < 1e-4
        assert 0.95 < flat.mean()


def test_places_outside_have_no_height(database: Path) -> None:
    outside = [[0, 0], [np.nan, 3_876_000], [np.inf, -np.inf], [1e300, 1e300], [504_999.9, 3_876_000]]
    with tiefort.open(database) as opened:
        assert np.isnan(opened.heights(outside)).all() and np.isnan(opened.normals(outside)).all()
        assert (opened.classes(outside) == 255).all()
        assert np.isfinite(opened.heights([[509_000, 3_878_000], [505_000, 3_875_000]])).all()
        assert opened.heights(np.empty((0, 2))).shape == (0,)
        for absolute in (False, True):
            sight = opened.line_of_sight([507_000, 3_876_000, 5000], [0, 0, 5000], absolute=absolute)
            assert not sight.visible and not sight.known and np.isnan(sight.clearance_m)
        with pytest.raises(tiefort.RequestError, match="no ground"):
            opened.viewshed((0, 0), 100)
        for wrong in ([1, 2, 3], ["a", "b"], 5, [[1j, 2]]):
            with pytest.raises(tiefort.RequestError, match="xy: found"):
                opened.heights(wrong)
        for row, col, level in ((6, 0, 0), (0, 8, 0), (-1, 0, 0), (0, 0, 5), (2**40, 0, 0)):
            with pytest.raises(tiefort.RequestError):
                opened.module(row, col, level)


def test_lines_of_sight_say_what_hides(database: Path) -> None:
    with tiefort.open(database) as opened:
        west, south, east, north = opened.bounds
        rng = np.random.default_rng(3)
        ends = rng.uniform((west, south), (east, north), (2, 400, 2))
        eyes, targets = (np.column_stack((end, opened.heights(end) + 2)) for end in ends)
        sight = opened.line_of_sight(eyes, targets, absolute=True)
        assert sight.known.all() and 0 < sight.visible.sum() < 400
        assert np.array_equal(sight.visible, opened.visible(eyes, targets, absolute=True))
        assert (sight.clearance_m[sight.visible] > -1e-6).all() and (sight.clearance_m[~sight.visible] < 1e-6).all()
        assert np.isnan(sight.blocker[sight.visible]).all()
        blockers = sight.blocker[~sight.visible]
        assert (blockers[:, 2] <= opened.heights(blockers[:, :2]) + 0.01).all()
        # By small steps.
        for eye, target, clearance in list(zip(eyes, targets, sight.clearance_m))[:50]:
            along = eye + np.linspace(0, 1, 2000)[:, None] * (target - eye)
            least = (along[:, 2] - opened.heights(along[:, :2])).min()
            assert clearance <= least + 1e-3 and least - clearance < 1.0
        # Heights above the ground, as on the command line.
        above = [np.column_stack((end, np.full(len(end), 2.0))) for end in ends]
        again = opened.line_of_sight(*above)
        assert np.array_equal(again.visible, sight.visible) and np.allclose(again.clearance_m, sight.clearance_m)
        one = opened.line_of_sight(eyes[0], targets, absolute=True)
        assert one.visible.shape == (400,) and one.blocker.shape == (400, 3)
        with pytest.raises(tiefort.RequestError, match="as many"):
            opened.line_of_sight(eyes, targets[:7])


def test_a_viewshed_is_the_lines_of_sight_to_its_places(database: Path) -> None:
    with tiefort.open(database) as opened:
        seen = opened.viewshed((507_000, 3_876_500), 800, eye_m=5, spacing_m=50)
        assert seen.visible.shape == (33, 33) and seen.visible[16, 16] and seen.visible.dtype == bool
        assert not seen.visible[0, 0] and 1 < seen.visible.sum() < 33 * 33
        place = np.array([507_000 + 3 * 50, 3_876_500 + 5 * 50])
        target = [*place, opened.heights(place)]
        assert seen.visible[16 - 5, 16 + 3] == opened.visible(seen.at, target, absolute=True)
        with pytest.raises(tiefort.RequestError, match="range_m"):
            opened.viewshed((507_000, 3_876_500), -1)
        with pytest.raises(tiefort.RequestError, match="larger spacing_m"):
            opened.viewshed((507_000, 3_876_500), 1e6, spacing_m=0.01)


def test_places_seen_from_one_eye_are_those_of_single_lines(database: Path) -> None:
    with tiefort.open(database) as opened:
        west, south, east, north = opened.bounds
        ends = np.random.default_rng(4).uniform((west, south), (east, north), (300, 2))
        targets = np.column_stack((ends, opened.heights(ends) + 2))
        eye = (*targets[0, :2], targets[0, 2] + 20)
        seen = opened.visible(eye, targets, absolute=True)
        assert 10 < seen.sum() < 290
        assert (seen == opened.line_of_sight(eye, targets, absolute=True).visible).all()


def test_a_database_goes_to_another_process_and_answers_are_compared_as_what_they_are(database: Path) -> None:
    with tiefort.open(database) as opened:
        again = pickle.loads(pickle.dumps(opened))
        middle = [(opened.bounds[0] + opened.bounds[2]) / 2, (opened.bounds[1] + opened.bounds[3]) / 2]
        assert again.heights(middle) == opened.heights(middle)
        job = pickle.loads(pickle.dumps(tiefort.Job(JOB)))
        assert job.settings == tiefort.Job(JOB).settings
        eye = [*middle, 2.0]
        first, second = opened.line_of_sight(eye, eye), again.line_of_sight(eye, eye)
        assert first == first and first != second and len({first, second}) == 2


def test_a_profile_is_the_heights_along_a_line(database: Path) -> None:
    with tiefort.open(database) as opened:
        through = [(506_000, 3_876_000), (507_000, 3_876_000), (507_000, 3_876_500)]
        found = opened.profile(*through, spacing_m=100)
        assert list(found.along_m) == [100 * step for step in range(16)]
        assert (found.heights == opened.heights(found.places)).all()
        assert (found.classes == opened.classes(found.places)).all()
        assert (opened.profile(*through[:2], spacing_m=100).heights == found.heights[:11]).all()
        with pytest.raises(tiefort.RequestError, match="two or more"):
            opened.profile(through[0])
        with pytest.raises(tiefort.RequestError, match="place 0: found 3 places"):
            opened.profile(through, through[0])
        with pytest.raises(tiefort.RequestError, match="spacing_m"):
            opened.profile(*through, spacing_m=0)
    done = run("profile", database, "506000,3876000", "507000,3876000", "--spacing", "100", "--format", "csv")
    assert done.returncode == 0 and len(done.stdout.splitlines()) == 12, done.stderr


def test_a_load_module_is_a_mesh(database: Path, tmp_path: Path) -> None:
    with tiefort.open(database) as opened:
        mesh = opened.module(2, 3)
        assert 0 < mesh.residual.mean_abs_m < mesh.residual.rms_m < mesh.residual.max_m
        inside = mesh.vertices[:, :2].mean(axis=0)
        assert mesh.sample(inside) == pytest.approx(opened.heights(inside), abs=1e-6)
        assert mesh.classes is not None and len(mesh.classes) == len(mesh.triangles)
        mesh.save(tmp_path / "ours.ply")
    done = run("export", database, "--format", "ply", "--modules", "2,3", "--out", tmp_path / "theirs.ply")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "ours.ply").read_bytes() == (tmp_path / "theirs.ply").read_bytes()


def test_the_whole_area_goes_to_other_packages(database: Path) -> None:
    with tiefort.open(database) as opened:
        xarray = pytest.importorskip("xarray")
        array = opened.to_xarray(250)
        assert isinstance(array, xarray.DataArray) and array.shape == (13, 17)
        assert float(array[0, 0]) == opened.heights([505_000, 3_878_000])
        assert float(array.y[0]) == 3_878_000 and float(array.x[0]) == 505_000
        again = tiefort.tin(array, triangles=50)
        assert again.crs == "EPSG:32611"
        pytest.importorskip("geopandas")
        modules = opened.modules
        assert len(modules) == 48 and modules.triangles.sum() == opened.report.triangles
        assert modules.total_bounds.tolist() == list(opened.bounds)


def test_features_are_tables_of_places(database: Path, tmp_path: Path) -> None:
    with tiefort.open(database) as opened, pytest.raises(tiefort.RequestError, match="no features"):
        opened.features()
    pytest.importorskip("geopandas")
    places = [[505_100, 3_875_500], [507_000, 3_876_000], [508_900, 3_876_100]]
    road = {"properties": {"highway": "primary"}, "geometry": {"type": "LineString", "coordinates": places}}
    roads = {"type": "FeatureCollection", "features": [{"type": "Feature", **road}]}
    (tmp_path / "roads.geojson").write_text(json.dumps(roads))
    sources = [{"file": str(tmp_path / "roads.geojson"), "crs": "EPSG:32611"}]
    tiefort.build({**JOB, "features": {"sources": sources}}, tmp_path / "roads.tdb")
    with tiefort.open(tmp_path / "roads.tdb") as opened:
        lines = opened.features()
        assert set(lines["class"]) == {"primary"} and lines.crs == opened.crs
        assert np.allclose(lines.total_bounds, [505_100, 3_875_500, 508_900, 3_876_100], atol=10)
        assert len(opened.features("decks")) == 0
        with pytest.raises(tiefort.RequestError, match="expected lines, nodes"):
            opened.features("roads")


def test_buildings_and_woods_hide_and_block(tmp_path: Path) -> None:
    def block(west: float, south: float, side: float, **tags: str) -> dict[str, object]:
        east, north = west + side, south + side
        ring = [[west, south], [east, south], [east, north], [west, north], [west, south]]
        return {"type": "Feature", "properties": tags, "geometry": {"type": "Polygon", "coordinates": [ring]}}

    blocks = [
        block(506_100, 3_876_100, 20, building="yes", height="30"),
        block(507_100, 3_876_600, 300, natural="wood"),
    ]
    (tmp_path / "town.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": blocks}))
    sources = [{"file": str(tmp_path / "town.geojson"), "crs": "EPSG:32611"}]
    tiefort.build({**JOB, "objects": {"sources": sources}}, tmp_path / "town.tdb")
    with tiefort.open(tmp_path / "town.tdb") as opened:
        eye, behind = [506_050, 3_876_110, 2], [506_170, 3_876_110, 2]
        found = opened.line_of_sight(eye, behind)
        assert not found.visible and found.hidden_by == "building" and abs(found.blocker[0] - 506_100) < 0.01
        assert opened.visible(eye, behind, objects="none")
        wood = opened.line_of_sight([507_050, 3_876_750, 2], [507_450, 3_876_750, 2], objects="all")
        assert wood.hidden_by in ("wood", "ground") and wood.transmission < 0.5
        assert opened.line_of_sight(eye, behind, objects="none").hidden_by == ""
        roof, ground = opened.tops([506_110, 3_876_110]), opened.heights([506_110, 3_876_110])
        assert 29.9 < roof - ground < 60 and opened.tops([506_050, 3_876_110]) == opened.heights(eye[:2])
        assert opened.tops([507_200, 3_876_700], woods=False) == opened.heights([507_200, 3_876_700])
        wall = opened.obstacle_at([506_098, 3_876_110], 3)
        assert (
            wall is not None and (wall.kind, wall.spacing_m) == ("building", None) and abs(wall.distance_m - 2) < 0.01
        )
        stems = opened.obstacle_at([507_200, 3_876_700], 3)
        assert stems is not None and stems.kind == "wood" and stems.spacing_m == 4
        assert opened.obstacle_at([506_050, 3_876_110], 3) is None
        with pytest.raises(tiefort.RequestError, match="expected a place in the area"):
            opened.obstacle_at([0, 0], 3)
        with pytest.raises(tiefort.RequestError, match="wheels_m: found nan"):
            opened.obstacle_at([506_050, 3_876_110], 3, wheels_m=float("nan"))
        masked = np.ma.masked_array([[506_050, 3_876_110]] * 2, mask=[[True, True], [False, False]])
        assert np.isnan(opened.heights(masked)).tolist() == [True, False]
        with pytest.raises(tiefort.RequestError, match='objects: found "some"'):
            opened.visible(eye, behind, objects="some")
        seen = opened.viewshed((506_110, 3_876_160), 60, eye_m=2, spacing_m=5)
        on_roofs = opened.viewshed((506_110, 3_876_160), 60, eye_m=60, spacing_m=5, target_on="roof")
        assert on_roofs.visible.sum() > seen.visible.sum()
        pytest.importorskip("geopandas")
        table = opened.objects()
        assert set(table.kind) == {"building", "wood"} and abs(table.area[table.kind == "building"].sum() - 400) < 1
        assert abs(table.area[table.kind == "wood"].sum() - 90_000) < 100


def test_a_closed_or_foreign_database_is_told(database: Path, tmp_path: Path) -> None:
    opened = tiefort.open(database)
    opened.heights([507_000, 3_876_000])
    opened.close()
    opened.close()
    for ask in (
        lambda: opened.heights([507_000, 3_876_000]),
        lambda: opened.module(0, 0),
        lambda: opened.explain(0, 0),
    ):
        with pytest.raises(tiefort.ClosedError, match="closed"):
            ask()
    (tmp_path / "other").mkdir()
    (tmp_path / "file").write_text("x")
    for name in ("other", "file", "missing"):
        with pytest.raises(tiefort.DatabaseError) as raised:
            tiefort.open(tmp_path / name)
        assert name in raised.value.message and raised.value.hint
    copy = tmp_path / "copy.tdb"
    shutil.copytree(database, copy)
    next((copy / "modules").iterdir()).write_bytes(b"broken")
    with pytest.raises(tiefort.DatabaseError):
        tiefort.open(copy)


def test_a_path_that_is_no_text_is_a_path(database: Path, tmp_path: Path) -> None:
    odd = os.fsdecode(bytes(tmp_path) + b"/\xff\xfe.tdb")
    shutil.copytree(database, odd)
    with tiefort.open(odd) as opened:
        assert np.isfinite(opened.heights([507_000, 3_876_000]))
    with tiefort.open(os.fsencode(odd)) as opened:
        assert "load modules" in repr(opened)
    assert tiefort.build(JOB, odd).unchanged
