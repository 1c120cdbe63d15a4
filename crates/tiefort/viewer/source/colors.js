// Colours: every scale is told apart by its lightness, too.

const HEIGHT = ["#47683f", "#7f9458", "#b9ad77", "#b58f62", "#96705a", "#b9aba5", "#f4f2ef"];
const USE = ["#00224e", "#35456c", "#666970", "#948e77", "#c8b866", "#fee838"];
const OVER = "#d0257a";
const DIVERGING = ["#2d4f9e", "#7ea6cf", "#f3f1ec", "#dd9a56", "#8a3d06"];
const UNKNOWN = "#8c8c8c";

const numbers = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
const linear = (value) => (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4);

function along(stops, share) {
  if (Number.isNaN(share)) return numbers(UNKNOWN);
  const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1), low = Math.min(Math.floor(at), stops.length - 2);
  const [a, b] = [numbers(stops[low]), numbers(stops[low + 1])];
  return a.map((value, i) => value + (at - low) * (b[i] - value));
}

/** Red, green, blue from 0 to 1 as screens have them. */
export const colorOf = {
  height: (area, metres) => along(HEIGHT, (metres - area.height_m[0]) / (area.height_m[1] - area.height_m[0] || 1)),
  limits: (area, count) =>
    area.limits.per_load_module < count ? numbers(OVER) : along(USE, count / area.limits.per_load_module),
  residuals: (area, rms) => along(USE, rms / area.residual_scale_m),
  residual: (area, metres) => along(DIVERGING, 0.5 + metres / (2 * area.residual_scale_m)),
};

/** The same for the renderer, which reckons with light. */
export const light = (color) => color.map(linear);

/** The same for style sheets and the map. */
export const bytes = (color) => color.map((value) => Math.round(255 * value));

/** What the legend of a way of colouring shows: stops, and words at both ends. */
export function legendOf(area, colors, showsDem) {
  const scale = area.residual_scale_m;
  if (colors === "limits") return [USE, "0", `${area.limits.per_load_module} ${area.limits.count} a load module`];
  if (colors === "height") return [HEIGHT, ...area.height_m.map((metres) => `${Math.round(metres)} m`)];
  if (showsDem) return [DIVERGING, `TIN ${scale} m above`, `below`];
  return [USE, "0", `${scale} m RMS in a load module`];
}
