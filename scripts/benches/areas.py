"""Rasters and gaming areas that benches run on; what cutting them into tiles costs, and each effort."""

import dataclasses
import json
import os
import pathlib
import tomllib

from benches.common import (DATA, FOLDER, ROOT, evaluate, faults, markdown, number, ratio, run, scratch, skip, tell,
                            why, write_heights, write_mesh)

# The desert window of every figure in the specification: columns 481 to 940, rows 0 to 375 from the NORTH. Greedy
# insertion (pydelatin) of 2,500 and 5,000 points has RMS 4.15 m and 2.55 m there, at 4,911 and 9,868 triangles.
DESERT = "ntc_scape/ntc_1024x1024_25m_assumed.tif"
DESERT_WINDOW = (481, 0, 460, 376)
WINDOW_POINTS = (2_500, 5_000)
# Other rasters get a vertex for so many posts, as the windows have 35 to 69 and the 50 km area has 51.
POSTS_PER_POINT = 50
SAMPLE_POSTS = 1001
# Above so many posts, Lindstrom-Turk takes minutes and up to a gigabyte.
LARGE_POSTS = 500_000


@dataclasses.dataclass
class Input:
    """A raster and the numbers of points to try on it. Heights: rows from the south, metres."""

    name: str
    points: tuple
    heights: object
    spacing_m: tuple
    dem: pathlib.Path
    raw: pathlib.Path

    @property
    def large(self):
        return LARGE_POSTS < self.heights.size


def inputs(tiefort, quick, wanted):
    """Every raster that is there and whose name is wanted, one at a time; what is missing is told."""
    stand_ins = "ntc_standin/tiefort_size_"
    named = [
        ("desert-window", DESERT, WINDOW_POINTS, DESERT_WINDOW),
        ("mackay-window", f"{stand_ins}mackay_idaho_460x376_utm12n.tif", WINDOW_POINTS),
        ("alps-window", f"{stand_ins}bavarian_alps_460x376_utm32n.tif", WINDOW_POINTS),
        ("alps-1979", "ntc_standin/bavarian_alps_50km_1979x1979_utm32n.tif", (76_500,)),
        ("desert-1024", DESERT),
        *((path.name.split("_")[0], f"dem/{path.name}") for path in sorted((DATA / "dem").glob("*.tif"))),
    ]
    for name, *rest in named[:1] if quick else named:
        if wanted(name):
            yield from found(name, *rest)
    if wanted("sample") and not quick:
        yield from sample(tiefort)


def found(name, file, points=None, window=None):
    """The raster at `file`, cut to `window`, when it is there and in metres."""
    path = DATA / file
    if not path.exists():
        return skip(name, f"no {path}")
    heights, spacing_m, profile = read(path, window)
    if heights is None:
        return skip(name, f"{file} is not in metres")
    tell(f"{name}: {file}, {heights.shape[1]} x {heights.shape[0]} posts")
    dem = FOLDER / f"{name}.tif"
    write_geotiff(dem, heights, profile)
    yield made(name, points, heights, spacing_m, dem)


def sample(tiefort):
    dem = FOLDER / "sample.tif"
    ran = run(tiefort, "sample", "--posts", SAMPLE_POSTS, "--out", dem)
    if ran["code"] != 0:
        return skip("sample", why(ran))
    heights, spacing_m, _ = read(dem)
    yield made("sample", None, heights, spacing_m, dem)


def made(name, points, heights, spacing_m, dem):
    raw = FOLDER / f"{name}.heights"
    write_heights(raw, heights)
    return Input(name, points or (heights.size // POSTS_PER_POINT // 100 * 100,), heights, spacing_m, dem, raw)


def read(path, window=None):
    """Heights from the south, spacing in metres, and what a copy needs. Heights are None where it is in degrees."""
    import numpy
    import rasterio
    from rasterio.windows import Window

    with rasterio.open(path) as raster:
        if raster.crs is None or not raster.crs.is_projected or raster.crs.linear_units_factor[1] != 1.0:
            return None, None, None
        part = Window(*window) if window else Window(0, 0, raster.width, raster.height)
        band = raster.read(1, window=part, masked=True)
        spacing_m = (raster.transform.a, -raster.transform.e)
        profile = {"crs": raster.crs, "transform": raster.window_transform(part), "dtype": band.dtype}
    band = numpy.ma.masked_invalid(band)
    if band.mask.any():
        # The peers know no voids. What is void in this data is the sea, so it becomes the lowest ground.
        tell(f"{path.name}: {int(band.mask.sum()):,} void posts are filled with the lowest height, {band.min()} m")
    return band.filled(band.min())[::-1].astype("f4"), spacing_m, profile


def write_geotiff(path, heights, profile):
    import rasterio

    rows, columns = heights.shape
    with rasterio.open(path, "w", driver="GTiff", width=columns, height=rows, count=1, **profile) as out:
        out.write(heights[::-1].astype(profile["dtype"]), 1)


# --- working grids ---


def working_grid(job, tiefort):
    """Heights of a job's working grid from the south, to 1/128 m: bilinear between the raster's posts; None without it.

    Written from the description of the compiler's resampling, since a regular grid of it is one of the yardsticks.
    """
    area, dem = job["area"], job["dem"]
    spacing_m = area["spacing_m"]
    posts = [int(size // spacing_m) + 1 for size in area["size_m"]]
    if "sources" in dem:
        path = pathlib.Path(dem["sources"][0])
    else:
        path = FOLDER / "sample-area.tif"
        ran = run(tiefort, "sample", "--posts", max(posts), "--spacing", spacing_m, "--seed", dem.get("seed", 1),
                  "--out", path)
        if ran["code"] != 0:
            return skip(f"the working grid of {area['name']}", why(ran))
    return resampled(path, area["origin_m"], spacing_m, posts)


def resampled(path, origin_m, spacing_m, posts):
    import numpy
    import rasterio

    heights, raster_spacing_m, profile = read(path)
    to_posts = ~profile["transform"]
    # The middle of the southernmost, westernmost pixel is post 0, 0.
    west, south = to_posts * tuple(origin_m)
    start = [west - 0.5, heights.shape[0] - 0.5 - south]
    taps = []
    for axis in (0, 1):
        place = start[axis] + numpy.arange(posts[axis]) * spacing_m / raster_spacing_m[axis]
        units = numpy.clip(numpy.floor(place * 65536 + 0.5), 0, (heights.shape[1 - axis] - 1) * 65536).astype("i8")
        near, weight = units >> 16, (units & 65535) / 65536
        taps.append((near, numpy.minimum(near + 1, heights.shape[1 - axis] - 1), weight))
    (west, east, u), (south, north, v) = taps
    exact = heights.astype("f8")
    lower = exact[numpy.ix_(south, west)] * (1 - u) + exact[numpy.ix_(south, east)] * u
    upper = exact[numpy.ix_(north, west)] * (1 - u) + exact[numpy.ix_(north, east)] * u
    mixed = lower * (1 - v)[:, None] + upper * v[:, None]
    return (numpy.floor(mixed * 128 + 0.5) / 128).astype("f4")


# --- gaming areas ---


# Areas that have a job in the project, and real rasters in metres that have none: as many load modules as fit.
CONFIGS = ["desert", "alps", "ntc", "ntc-even"]
RASTERS = {"mackay": "dem/mackay_idaho_738x919_30m_utm12n.tif", "baja": "dem/baja_california_sur_1264x1005_29m.tif",
           "big-butte": "dem/big_butte_idaho_623x672_30m_utm12n.tif",
           "big-tujunga": "dem/bigtujunga_california_1197x643_30m_utm11n.tif",
           "missoula": "dem/missoula_valley_714x975_31m_utm11n.tif"}
REAL = ["desert", "alps", *RASTERS]
EFFORTS = ("fast", "normal", "best")
SIGHTS = (True, False)
# The bisection ends this near to the mean it looks for, in triangles per load module; or with points this near to each
# other, in parts of them, as when limits hold the mean below it whatever the points.
MEAN_WITHIN = 0.02
POINTS_WITHIN = 0.002
BUILDS_MAX = 14
NEAR_SEAMS_M = 1000
MODULE_M = 500
# The working grid of rasters without a job: a border step of 125 m is a whole number of these.
WORKING_M = 25
# Lines of sight are judged at these heights of eyes, in metres.
EYES_M = ("1", "2.5", "10")
HEAD = ["", "mean", "RMS m", "of paper", "of grid", "max m", "mean m", "largest", "4 km", "breaches", "seconds", "MB",
        "valid", "sight %", "visible %", "slope RMS"]


@dataclasses.dataclass
class Area:
    """A job to start from, and its working grid as the evaluator reads it."""

    name: str
    job: dict
    heights: object
    raw: object
    spacing_m: tuple


def areas(tiefort, quick, wanted, names=CONFIGS):
    """The jobs that are wanted and whose rasters are there. The sample comes twice: with importance and without."""
    for name in filter(wanted, ["desert"] if quick else names):
        job = job_of_raster(name) if name in RASTERS else job_of_config(name)
        area = job and area_of(tiefort, name, job)
        if area:
            yield area


def area_of(tiefort, name, job):
    """A job with its working grid; None when that cannot be had."""
    heights = working_grid(job, tiefort)
    if heights is None:
        return None
    raw = FOLDER / f"{name}-area.heights"
    write_heights(raw, heights)
    return Area(name, job, heights, raw, (job["area"]["spacing_m"],) * 2)


def job_of_config(name):
    """A job of the project; None when its raster is missing."""
    folder = ROOT / ("configs" if name.startswith("ntc") else "tests/jobs")
    job = tomllib.loads((folder / f"{name.removesuffix('-even')}.toml").read_text())
    if name.endswith("-even"):
        job.pop("importance")
    sources = [DATA / path.split("shared/data/")[-1] for path in job["dem"].get("sources", [])]
    missing = [path for path in sources if not path.exists()]
    if missing:
        return skip(name, f"no {missing[0]}")
    if sources:
        job["dem"]["sources"] = [str(path) for path in sources]
    return job


def job_of_raster(name):
    """A job like those of the project over a raster, as many load modules as lie inside; None when it is missing."""
    if not (DATA / RASTERS[name]).exists():
        return skip(name, f"no {DATA / RASTERS[name]}")
    heights, spacing_m, profile = read(DATA / RASTERS[name])
    source = FOLDER / f"{name}-area.tif"
    write_geotiff(source, heights, profile)
    # The middle of the south-westernmost pixel is the first post.
    west, south = profile["transform"] * (0.5, heights.shape[0] - 0.5)
    reach = [(posts - 1) * step for posts, step in zip(heights.shape[::-1], spacing_m)]
    start = [-(-west // WORKING_M) * WORKING_M, -(-south // WORKING_M) * WORKING_M]
    size = [int((first + length - begin) // MODULE_M) * MODULE_M
            for first, length, begin in zip((west, south), reach, start)]
    epsg = profile["crs"].to_epsg()
    return {
        "area": {"name": name, "crs": f"EPSG:{epsg}", "origin_m": start, "size_m": size, "spacing_m": WORKING_M},
        "dem": {"sources": [str(source)], "voids": "fail"},
        "tiles": {"columns": 6, "rows": 6},
        "limits": {"per_load_module": 100, "mean_per_load_module": 32, "per_4km_square": 4096},
        "tin": {"method": "optimised"},
    }


# --- jobs ---


def toml(value):
    """A value of a job as TOML; JSON's notation is TOML's but for tables."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value)


def changed(job, **sections):
    """A job with keys of some sections set; `tin` is replaced as a whole."""
    job = {name: dict(section) for name, section in job.items()}
    for name, keys in sections.items():
        job[name] = dict(keys) if name == "tin" else job.get(name, {}) | keys
    return job


def write_job(job):
    path = FOLDER / "job.toml"
    lines = []
    for name, section in job.items():
        lines += [f"[{name}]", *(f"{key} = {toml(value)}" for key, value in section.items()), ""]
    path.write_text("\n".join(lines))
    return path


def build(tiefort, area, job, judge=True, page=True, options=()):
    """Builds a database from nothing; what the run took, what it reports, and what the evaluator says of it."""
    path = write_job(job)
    words = ["--fresh", "--quiet"] + ([] if page else ["--no-html"])
    with scratch("area.tdb") as database:
        ran = run(tiefort, "build", path, "--out", database, "--workers", os.cpu_count(), *words)
        if ran["code"] not in (0, 1):
            return ran
        ran["report"] = json.loads((database / "report.json").read_text())
        if judge:
            ran["judged"] = judge_database(database, area, *options)
            check_against_report(ran, area)
    return ran


def check_against_report(ran, area):
    theirs, ours = ran["report"]["residual"]["rms_m"], ran["judged"]["rms_m"]
    if 0.001 * ours < abs(theirs - ours):
        tell(f"NOTE {area.name}: report.json has RMS {theirs:.4f} m, the evaluator {ours:.4f} m")


def judge_database(database, area, *options):
    """Load modules as one mesh, welded where they hold equal points, read by the project's reader in Python."""
    import read_slm

    ids, vertices, triangles, lines = {}, [], [], [set(), set()]
    for path in sorted((database / "modules").glob("*.slm")):
        header, modules = read_slm.parse(path.read_bytes())
        side, cells = header["side"], header["side_cells"]
        lines[0].add(header["columns"][0] * cells)
        lines[1].add(header["rows"][0] * cells)
        for module in (module for module in modules if module["level"] == 0):
            own = []
            for x, y, z in module["vertices"]:
                point = (module["column"] * side + x, module["row"] * side + y, z)
                own.append(ids.setdefault(point, len(ids)))
                if own[-1] == len(vertices):
                    vertices.append((point[0] * cells / side, point[1] * cells / side, z / 128))
            triangles += [(own[a], own[b], own[c]) for a, b, c in module["triangles"]]
    mesh = FOLDER / "area.mesh"
    write_mesh(mesh, vertices, triangles, side // cells)
    columns, rows = (",".join(map(str, sorted(found - {0}))) for found in lines)
    return evaluate(mesh, area.raw, area.spacing_m, "--seams", f"{columns}/{rows}",
                    int(NEAR_SEAMS_M // area.spacing_m[0]), *options)


# --- at equal triangles ---


def compare(tiefort, area):
    """The table of an area; its rows for machines, by name."""
    limit = area.job["limits"]["mean_per_load_module"]
    tell(f"{area.name}: the regular grid, and paper + clip brought to {limit} triangles per load module")
    results = {"regular grid": regular_grid(area)}
    for allocation in ("equal", "global"):
        results[f"paper + clip, {allocation}"] = paper_clip(tiefort, area, limit, allocation)
    for name, tin in optimised(tiefort, area):
        tell(f"{area.name}: {name}")
        ran = build(tiefort, area, changed(area.job, tin=tin))
        if "report" in ran:
            results[name] = row_of(ran)
        else:
            skip(f"{area.name}, {name}", why(ran))
    results = {name: result for name, result in results.items() if result}
    paper, grid = best_paper(results).get("rms_m"), results["regular grid"]["rms_m"]
    seen = results["regular grid"]["judged"]["sight"]["dem_visible"]
    title = f"{area.name}: whole area, all limits (the DEM shows {100 * seen:.1f} % of lines of sight)"
    markdown(title, HEAD, [cells(name, result, paper, grid) for name, result in results.items()])
    return results


def optimised(tiefort, area):
    """What the compiler is asked for, by name; one row as it is where it does not know efforts yet."""
    plain = {"method": "optimised"}
    asked = plain | {"effort": EFFORTS[0], "sight": SIGHTS[0]}
    ran = run(tiefort, "plan", write_job(changed(area.job, tin=asked)))
    if ran["code"] != 0:
        skip(f"{area.name}, efforts", f"{why(ran)}; `optimised` is run as it is")
        return [("optimised, as it is", plain)]
    return [(effort + (", sight" if sight else ""), plain | {"effort": effort, "sight": sight})
            for effort in EFFORTS for sight in SIGHTS]


def best_paper(results):
    """The paper's row of lowest RMS. Its own practice is equal shares of points; shares by need are stronger."""
    rows = [result for name, result in results.items() if name.startswith("paper + clip")]
    return min(rows, key=lambda row: row["rms_m"], default={})


def row_of(ran):
    report = ran["report"]
    return {
        "mean": report["per_load_module"]["mean"],
        "largest": report["per_load_module"]["max"],
        "window": report["per_4km"]["max"],
        "breaches": len(report["breaches"]),
        "triangles": report["triangles"],
        **{key: report["residual"][key] for key in ("rms_m", "max_m", "mean_abs_m")},
        "seconds": ran["wall_s"],
        "cpu_s": ran["cpu_s"],
        "peak_mb": ran["peak_mb"],
        "judged": ran.get("judged"),
    }


def paper_clip(tiefort, area, mean, allocation):
    """The paper's method with clipped edges at the number of points that gives `mean` triangles per load module.

    The limit on the mean is lifted meanwhile, or points would be taken out to meet it after they were chosen; the
    limits of a load module and of a 4 km square stay.
    """
    limits = {"mean_per_load_module": area.job["limits"]["per_load_module"]}
    modules = area.job["area"]["size_m"][0] * area.job["area"]["size_m"][1] // MODULE_M**2
    tin = {"method": "paper", "key": "max", "allocation": allocation}
    low, high, best = 0, modules * mean, None
    points = modules * mean // 4
    for _ in range(BUILDS_MAX):
        job = changed(area.job, limits=limits, load_modules={"edges": "clip"}, tin=tin | {"points": int(points)})
        ran = build(tiefort, area, job, judge=False)
        if "report" not in ran:
            return skip(f"{area.name}, paper + clip", why(ran))
        found = ran["report"]["per_load_module"]["mean"]
        if best is None or abs(found - mean) < abs(best[0] - mean):
            best = (found, job)
        if abs(found - mean) <= MEAN_WITHIN or high - low <= POINTS_WITHIN * high:
            break
        low, high = (points, high) if found < mean else (low, points)
        points = (low + high) // 2
    return row_of(build(tiefort, area, best[1])) | {"points": best[1]["tin"]["points"]}


def regular_grid(area):
    """A vertex every border step, two triangles a cell: 32 a load module of 500 m at 125 m."""
    import numpy

    step = int(area.job.get("load_modules", {}).get("border_step_m", 125) // area.spacing_m[0])
    rows, columns = (numpy.arange(0, posts, step) for posts in area.heights.shape)
    y, x = (axis.ravel() for axis in numpy.meshgrid(rows, columns, indexing="ij"))
    a = (numpy.arange(len(rows) - 1)[:, None] * len(columns) + numpy.arange(len(columns) - 1)).ravel()
    b, c, d = a + 1, a + 1 + len(columns), a + len(columns)
    mesh = FOLDER / "area.mesh"
    write_mesh(mesh, numpy.column_stack([x, y, area.heights[y, x]]),
               numpy.concatenate([numpy.column_stack([a, b, c]), numpy.column_stack([a, c, d])]))
    judged = evaluate(mesh, area.raw, area.spacing_m)
    cells_a_side = MODULE_M / area.spacing_m[0] / step
    result = {key: judged[key] for key in ("rms_m", "max_m", "mean_abs_m", "triangles")}
    return result | {"mean": 2 * cells_a_side**2, "judged": judged}


def cells(name, result, paper, grid):
    judged = result["judged"]
    sight = judged["sight"]
    return [
        name, number(result["mean"], 2), number(result["rms_m"], 3), ratio(result["rms_m"], paper),
        ratio(result["rms_m"], grid), number(result["max_m"], 1), number(result["mean_abs_m"], 3),
        number(result.get("largest"), 0), number(result.get("window"), 0), number(result.get("breaches"), 0),
        number(result.get("seconds"), 2), number(result.get("peak_mb"), 0), faults(judged),
        number(100 * sight["agreement"], 1), number(100 * sight["tin_visible"], 1),
        number(judged["slope_rms_degrees"], 2),
    ]


# --- the cost of tiles ---


def tiling(tiefort, area):
    """RMS of one area in ever more tiles, points shared by what they gain and equally; and near tile lines."""
    effort = {} if optimised(tiefort, area)[0][0] == "optimised, as it is" else {"effort": "normal"}
    results, rows = {}, []
    for side in (1, 3, 6, 12):
        for allocation in ("global", "equal") if 1 < side else ("global",):
            name = f"{side} x {side}" + (f", {allocation}" if 1 < side else "")
            tell(f"{area.name}: tiles {name}")
            tin = {"method": "optimised", "allocation": allocation} | effort
            ran = build(tiefort, area, changed(area.job, tiles={"columns": side, "rows": side}, tin=tin))
            if "report" not in ran:
                skip(f"{area.name}, tiles {name}", why(ran))
                continue
            results[name] = row_of(ran)
    whole = results.get("1 x 1", {}).get("rms_m")
    for name, result in results.items():
        seams = result["judged"].get("seams", {})
        near = ratio(seams["rms_m"], seams["others_rms_m"]) if seams.get("posts") else ""
        rows.append([name, number(result["mean"], 2), number(result["rms_m"], 3), ratio(result["rms_m"], whole),
                     number(result["max_m"], 1), near, number(result["breaches"], 0), number(result["seconds"], 2),
                     number(result["peak_mb"], 0), faults(result["judged"])])
    head = ["tiles", "mean", "RMS m", "of 1 x 1", "max m", f"RMS within {NEAR_SEAMS_M} m of a tile line, of elsewhere",
            "breaches", "seconds", "MB", "valid"]
    markdown(f"{area.name}: what tiles cost", head, rows)
    return results


# --- what each effort costs and gains ---


EFFORT_ROWS = {"fast": {"effort": "fast"}, "normal": {"effort": "normal"}, "best": {"effort": "best"},
               "normal, sight = false": {"effort": "normal", "sight": False}}
# An earlier program has the same efforts.
BEFORE_ROWS = {"before, fast": {"effort": "fast"}, "before, normal": {"effort": "normal"}}
EFFORT_HEAD = ["", "RMS m", "of normal", *(f"sight at {eye} m" for eye in EYES_M), "angles below 5°", "cpu s",
               "of normal"]


def efforts(tiefort, area, before):
    """Residual, lines of sight, thin triangles and processor time of every effort; of an earlier program's, too."""
    results = {}
    rows = [(tiefort, *row) for row in EFFORT_ROWS.items()]
    rows += [(before, *row) for row in BEFORE_ROWS.items()] if before else []
    for program, name, tin in rows:
        tell(f"{area.name}: {name}")
        job = changed(area.job, tin={"method": "optimised"} | tin)
        ran = build(program, area, job, page=False, options=["--eyes", ",".join(EYES_M)])
        if "report" in ran:
            results[name] = row_of(ran)
        else:
            skip(f"{area.name}, {name}", why(ran))
    markdown(f"{area.name}: what each effort costs and gains", EFFORT_HEAD, [
        effort_cells(name, result, results.get("normal")) for name, result in results.items()])
    return results


def effort_cells(name, result, normal):
    judged = result["judged"]
    ratios = [ratio(result[key], normal and normal[key], 2 if key == "cpu_s" else 3) for key in ("rms_m", "cpu_s")]
    return [
        name, number(result["rms_m"], 3), ratios[0],
        *(f"{100 * judged['agreement_at_m'][eye]:.2f} %" for eye in EYES_M),
        f"{100 * judged['least_angle_below']['5']:.2f} %", number(result["cpu_s"], 2), ratios[1],
    ]
