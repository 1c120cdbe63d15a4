// Colours: those of the server's pictures (`area.palette`, crates/views), so that a map here is read as one there.

const known = new Map();

/** Red, green and blue from 0 to 1 of `#547a4e`. */
export function numbers(hex) {
  if (!known.has(hex)) known.set(hex, [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255));
  return known.get(hex);
}

/** Levels of detail, from the finest, and what is drawn coarsely. */
const LEVELS = ["#f1e3b0", "#e2a76f", "#b6638a", "#6d4a8f", "#4b4b57"];

function along(stops, share) {
  const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1), low = Math.min(Math.floor(at), stops.length - 2);
  const [a, b] = [numbers(stops[low]), numbers(stops[low + 1])];
  return a.map((value, i) => value + (at - low) * (b[i] - value));
}

const orNothing = (area, stops, share) => (Number.isNaN(share) ? numbers(area.palette.nothing) : along(stops, share));

/** A desert's heights, rock, haze and sky; its lakes and streams are playas and washes, and dry. */
const DESERT = {
  heights: ["#dccaa6", "#d3bc94", "#c6a982", "#b69572", "#a58264", "#97755e", "#a08674", "#bba998"],
  rock: "#8d7260", haze: "#e6ded2", sky: ["#b9c4d0", "#efe9df"],
};
const DRY = { lake: "#e9dfc9", river: "#b0936a", stream: "#b0936a" };

/** Lets the built-in desert look like one. */
export function dried(area) {
  if (!area.is_desert) return;
  Object.assign(area.palette, DESERT);
  area.class_colors = area.classes.map((name, i) => DRY[name] ?? area.class_colors[i]);
}

const WATERS = new Set(["water", "lake", "river", "stream", "sea"]);

/** Red, green, blue from 0 to 1 as screens have them. */
export const colorOf = {
  /** Of what is known by its class: water, holes, roads; undefined for plain ground. */
  cover: (area, ofClass) => {
    if (ofClass === area.hole) return numbers(area.palette.nothing);
    if (area.class_colors[ofClass]) return numbers(area.class_colors[ofClass]);
    return ofClass === area.water ? numbers(area.palette.water) : undefined;
  },
  /** Of a deck whose class says nothing of its colour. */
  deck: () => [0.42, 0.4, 0.38],
  height: (area, metres) =>
    orNothing(area, area.palette.heights, (metres - area.height_m[0]) / (area.height_m[1] - area.height_m[0] || 1)),
  limits: (area, count) =>
    area.limits.per_load_module < count
      ? numbers(area.palette.breach)
      : orNothing(area, area.palette.use, count / area.limits.per_load_module),
  /** Of water without a class. */
  sea: (area) => numbers(area.palette.water),
  /** Of a level of detail. */
  levels: (_, level) => numbers(LEVELS[Math.min(level, LEVELS.length - 1)]),
  residuals: (area, rms) => orNothing(area, area.palette.errors, rms / area.residual_scale_m),
  residual: (area, metres) => orNothing(area, area.palette.residuals, 0.5 + metres / (2 * area.residual_scale_m)),
};

/** The same for style sheets, the map and the renderer. */
export const bytes = (color) => color.map((value) => Math.min(Math.max(Math.round(255 * value), 0), 255));

/** What a tint is of, as its fourth byte tells the shader: ground, something made by hands, water. */
export const GROUND = 0, MADE = 127, WATER = 255;

/** Whether a class is water. */
export function isWater(area, ofClass) {
  return ofClass === area.water || (!area.is_desert && WATERS.has(area.classes[ofClass]));
}

/** What the legend of a way of colouring shows: stops, and words at both ends. */
export function legendOf(area, colors, showsDem) {
  const scale = area.residual_scale_m, { heights, use, errors, residuals } = area.palette;
  if (colors === "limits") return [use, "0", `${area.limits.per_load_module} ${area.limits.count} a load module`];
  if (colors === "going") return [["#40943f", "#f2d959", "#e68026", "#b81414"], "level", "45 % and more"];
  if (colors === "levels") return [LEVELS, "finest level", "coarser"];
  if (colors === "height") return [heights, ...area.height_m.map((metres) => `${Math.round(metres)} m`)];
  if (showsDem) return [residuals, `TIN ${scale} m above`, `below`];
  return [errors, "0", `${scale} m RMS in a load module`];
}
