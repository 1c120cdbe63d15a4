"""What the project asks of itself, held against the figures of a run. A bar without figures is left out."""

from fidelity.areas import best_paper
from fidelity.workshop import markdown

# Lines of sight are judged on the desert window at 9,868 triangles.
SIGHT_INPUT = "desert-window 5000"
# The 50 km area of 320,000 triangles: seconds by effort, and memory.
LARGE_AREA = "ntc-even"
BAR_SECONDS = {"fast": 1.0, "normal": 8.0, "best": 40.0}
BAR_MEMORY_MB = 400
OURS = ("fast", "normal", "best", "normal, on posts", "fast, sight", "normal, sight", "best, sight")


def tell(results):
    """Prints every bar as a table; the names of those that are missed."""
    rows = [*rasters(results["rasters"]), *limited(results["areas"]), *seams(results["tiles"]),
            *efforts(results["efforts"])]
    if not rows:
        return []
    print("\n## Bars")
    markdown("at most, unless it says at least", ["what", "found", "bar", ""], [
        [what, f"{found:.3f}", f"{'at least ' if least else ''}{bar:g}", "met" if met(found, bar, least) else "MISSED"]
        for what, found, bar, least in rows
    ])
    return [what for what, found, bar, least in rows if not met(found, bar, least)]


def met(found, bar, least):
    return bar <= found if least else found <= bar


def rasters(inputs):
    for name, results in inputs.items():
        if "fast" not in results and "normal" not in results:
            continue
        invalid = sum(not results[row]["judged"]["valid"] for row in OURS if row in results)
        yield f"{name}: our meshes that are no valid surface", invalid, 0, False
        yield from over(name, results, "normal", "greedy", 0.45)
        yield from over(name, results, "normal", "Lindstrom-Turk", 0.80)
        yield from over(name, results, "fast", "Lindstrom-Turk", 1.02)
        yield from over(name, results, "normal, on posts", "Lindstrom-Turk", 1.0)
        yield from seconds_over(name, results, "normal", "Lindstrom-Turk", 0.1)
        yield from seconds_over(name, results, "fast", "Lindstrom-Turk", 0.01)
        if name == SIGHT_INPUT:
            yield from sight(name, results)


def over(name, results, ours, peer, bar):
    if ours in results and peer in results:
        found = results[ours]["judged"]["rms_m"] / results[peer]["judged"]["rms_m"]
        yield f"{name}: RMS of {ours}, of {peer}", found, bar, False


def seconds_over(name, results, ours, peer, bar):
    if ours in results and peer in results:
        yield f"{name}: seconds of {ours}, of {peer}", results[ours]["seconds"] / results[peer]["seconds"], bar, False


def sight(name, results):
    aimed, normal = (results.get(row, {}).get("judged") for row in ("normal, sight", "normal"))
    if normal:
        yield f"{name}: agreement of normal, %", 100 * normal["sight"]["agreement"], 95.5, True
        slope = normal["slope_rms_degrees"] / results["greedy"]["judged"]["slope_rms_degrees"]
        yield f"{name}: slope RMS of normal, of greedy", slope, 0.65, False
    if aimed:
        yield f"{name}: agreement of normal, sight, %", 100 * aimed["sight"]["agreement"], 96.0, True
        share = aimed["sight"]["tin_visible"] / aimed["sight"]["dem_visible"]
        yield f"{name}: visible share of normal, sight, away from the DEM's", abs(share - 1.0), 0.05, False
    if aimed and normal:
        yield f"{name}: RMS of normal, sight, of normal", aimed["rms_m"] / normal["rms_m"], 1.06, False


def limited(jobs):
    for name, results in jobs.items():
        paper, grid = best_paper(results), results.get("regular grid")
        for effort, bar in [("fast", 0.60), ("normal", 0.45), ("best", 0.43)]:
            ours = results.get(effort)
            if not ours or not paper:
                continue
            yield f"{name}: RMS of {effort}, of paper + clip", ours["rms_m"] / paper["rms_m"], bar, False
            yield f"{name}: largest residual of {effort}, of paper + clip", ours["max_m"] / paper["max_m"], 1.0, False
            yield f"{name}: breaches of {effort}", ours["breaches"], 0, False
            if effort == "normal":
                yield f"{name}: RMS of normal, of the regular grid", ours["rms_m"] / grid["rms_m"], 0.23, False
            if name == LARGE_AREA:
                yield f"{name}: seconds of {effort}", ours["seconds"], BAR_SECONDS[effort], False
                yield f"{name}: MB of {effort}", ours["peak_mb"], BAR_MEMORY_MB, False


def seams(jobs):
    for name, results in jobs.items():
        for tiles, result in results.items():
            found = result["judged"].get("seams", {})
            if tiles == "6 x 6, global" and found.get("posts"):
                yield f"{name}: RMS near tile lines, of elsewhere", found["rms_m"] / found["others_rms_m"], 1.03, False


# What an effort may have of the residual that an earlier program's has: which, of which, at most.
OF_BEFORE = [("fast", "before, fast", 0.95), ("normal", "before, normal", 1.0), ("best", "before, normal", 0.94),
             ("normal, sight = false", "before, normal", 0.97)]
# Share of lines of sight that `normal` keeps beyond what it kept before.
MORE_SIGHT = 0.005


def efforts(jobs):
    for name, results in jobs.items():
        for ours, earlier, bar in OF_BEFORE:
            if ours in results and earlier in results:
                found = results[ours]["rms_m"] / results[earlier]["rms_m"]
                yield f"{name}: RMS of {ours}, of {earlier}", found, bar, False
        now, before = results.get("normal"), results.get("before, normal")
        if not now or not before:
            continue
        now, before = now["judged"], before["judged"]
        for eye, kept in before["agreement_at_m"].items():
            gained = 100 * (now["agreement_at_m"][eye] - kept)
            yield f"{name}: lines of sight at {eye} m gained by normal, points", gained, 100 * MORE_SIGHT, True
        thin = [100 * judged["least_angle_below"]["5"] for judged in (now, before)]
        yield f"{name}: angles below 5 degrees of normal, %, at most as before", thin[0], thin[1], False
