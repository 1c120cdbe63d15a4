// Colours: those of the server's pictures (`area.palette`, crates/views), so that a map here is read as one there.

const numbers = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
const linear = (value) => (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4);

function along(stops, share) {
  const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1), low = Math.min(Math.floor(at), stops.length - 2);
  const [a, b] = [numbers(stops[low]), numbers(stops[low + 1])];
  return a.map((value, i) => value + (at - low) * (b[i] - value));
}

const known = (area, stops, share) => (Number.isNaN(share) ? numbers(area.palette.nothing) : along(stops, share));

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
    known(area, area.palette.heights, (metres - area.height_m[0]) / (area.height_m[1] - area.height_m[0] || 1)),
  limits: (area, count) =>
    area.limits.per_load_module < count
      ? numbers(area.palette.breach)
      : known(area, area.palette.use, count / area.limits.per_load_module),
  residuals: (area, rms) => known(area, area.palette.errors, rms / area.residual_scale_m),
  residual: (area, metres) => known(area, area.palette.residuals, 0.5 + metres / (2 * area.residual_scale_m)),
};

/** The same for the renderer, which reckons with light. */
export const light = (color) => color.map(linear);

/** The same for style sheets and the map. */
export const bytes = (color) => color.map((value) => Math.round(255 * value));

/** What the legend of a way of colouring shows: stops, and words at both ends. */
export function legendOf(area, colors, showsDem) {
  const scale = area.residual_scale_m, { heights, use, errors, residuals } = area.palette;
  if (colors === "limits") return [use, "0", `${area.limits.per_load_module} ${area.limits.count} a load module`];
  if (colors === "height") return [heights, ...area.height_m.map((metres) => `${Math.round(metres)} m`)];
  if (showsDem) return [residuals, `TIN ${scale} m above`, `below`];
  return [errors, "0", `${scale} m RMS in a load module`];
}
