"""What README and the book show of the figures of bench_fidelity.py: three short tables."""

from book import FIGURES, ROOT, put
from fidelity.areas import EFFORT_HEAD, EFFORT_ROWS, effort_cells

# Rows of a raster and of an area as they are called there, and as they are called here.
RASTER_ROWS = {"greedy": "greedy insertion (`pydelatin`)", "Lindstrom-Turk": "edge collapse (CGAL, Lindstrom-Turk)",
               "fast": "`fast`", "normal, sight": "`normal` (default)", "best, sight": "`best`",
               "normal": "`normal`, `sight = false`"}
AREA_ROWS = {"regular grid": "regular grid of 125 m", "paper + clip": "the paper's method, clipped",
             "fast": "`fast`", "normal, sight": "`normal` (default)", "best, sight": "`best`",
             "normal": "`normal`, `sight = false`"}
HEAD = "| {} | RMS m | largest m | lines of sight | slope RMS | s |\n| - | -: | -: | -: | -: | -: |\n"


def row(name, result, rms_m, max_m):
    judged = result["judged"]
    sight, slope = 100 * judged["sight"]["agreement"], judged["slope_rms_degrees"]
    seconds = f"{result['seconds']:.2f}" if result.get("seconds") else ""
    return f"| {name} | {rms_m:.3f} | {max_m:.1f} | {sight:.1f} % | {slope:.2f}° | {seconds} |\n"


def of_raster(results):
    some = next(iter(results.values()))["judged"]
    text = HEAD.format(f"the desert window, 460 x 376 posts, {some['triangles']:,} triangles")
    for name, shown in RASTER_ROWS.items():
        if name in results:
            judged = results[name]["judged"]
            text += row(shown, results[name], judged["rms_m"], judged["max_m"])
    return text


def of_area(name, results):
    best = min((key for key in results if key.startswith("paper + clip")), key=lambda key: results[key]["rms_m"])
    results = results | {"paper + clip": results[best]}
    text = HEAD.format(f"the whole {name}, 6 x 6 tiles, 32 triangles a load module, all limits")
    for key, shown in AREA_ROWS.items():
        if key in results:
            text += row(shown, results[key], results[key]["rms_m"], results[key]["max_m"])
    return text


def of_readme(results):
    """The regular grid, the paper's method and the program as it is by default, in three columns."""
    clipped = min((found for key, found in results.items() if key.startswith("paper + clip")),
                  key=lambda found: found["rms_m"])
    rows = {"regular grid of 125 m": results["regular grid"], "the founding paper's method": clipped,
            "tiefort": results["normal, sight"]}
    text = "| the same desert of 25 km, 32 triangles a load module | RMS residual | lines of sight kept |\n"
    text += "| - | -: | -: |\n"
    for name, found in rows.items():
        text += f"| {name} | {found['rms_m']:.3f} m | {100 * found['judged']['sight']['agreement']:.1f} % |\n"
    return text


def of_efforts(areas):
    """What each effort costs and gains, area after area."""
    text = ""
    for name, results in areas.items():
        lines = [[name, *EFFORT_HEAD[1:]], ["-", *["-:"] * (len(EFFORT_HEAD) - 1)]]
        normal, rows = results.get("normal"), [row for row in EFFORT_ROWS if row in results]
        lines += [effort_cells(f"`{row}`", results[row], normal) for row in rows]
        text += "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n\n"
    return text


def write(results):
    """Puts the tables where README and the book have them."""
    if results["efforts"]:
        put(FIGURES, "efforts", of_efforts(results["efforts"]))
    if not results["rasters"] or not results["areas"]:
        return
    raster = [found for name, found in results["rasters"].items() if name.startswith("desert-window")][-1]
    text = of_raster(raster) + "\n" + "\n".join(of_area(*item) for item in results["areas"].items())
    put(FIGURES, "fidelity", text)
    put(ROOT / "README.md", "headline", of_readme(results["areas"]["desert"]))
