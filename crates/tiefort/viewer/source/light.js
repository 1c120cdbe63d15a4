// What lies on the ground from afar: slopes, shadows and hollows of the whole area, reckoned from heights on a grid
// into the four bytes of a texel. Runs beside the page (worker.js).

/** Steepness that a byte can tell: rise over run. Its root is kept, so that plains have fine steps. */
export const STEEPEST = 4;
/** Metres around a place that say whether it lies in a hollow, and how much lower is quite hollow. */
const AROUND_M = 400, HOLLOW_M = 70;
/** How wide the edge of a shadow is, the tangent of the sun's disc, made larger to look soft on a coarse grid; and how
 * many posts it is wide at least, so that it has no steps. */
const SOFT = 0.06, SOFT_POSTS = 2;

const packed = (rise) =>
  Math.round(127.5 + 127.5 * Math.sign(rise) * Math.sqrt(Math.min(Math.abs(rise) / STEEPEST, 1)));

/** Mean heights within a square of `reach` posts each way, by sums that run along rows, then along columns. */
function blurred({ wide, high, heights }, reach) {
  const pass = (from, lines, length, lineStep, step) => {
    const to = new Float32Array(from.length);
    for (let line = 0; line < lines; line++) {
      const at = (i) => line * lineStep + Math.min(Math.max(i, 0), length - 1) * step;
      let sum = 0;
      for (let i = -reach; i <= reach; i++) sum += from[at(i)];
      for (let i = 0; i < length; i++) {
        to[at(i)] = sum / (2 * reach + 1);
        sum += from[at(i + reach + 1)] - from[at(i - reach)];
      }
    }
    return to;
  };
  return pass(pass(heights, high, wide, wide, 1), wide, high, 1, wide);
}

/** How far each post is from the edge of a shadow, 0 in it to 255 in the sun, the edge lying in the middle: the height
 * of the shadow above it is carried from post to post, away from the sun, along the axis nearer to that direction. */
function sunlight({ wide, high, heights, step }, sun) {
  const lit = new Uint8Array(wide * high).fill(255), top = new Float32Array(wide * high);
  const level = Math.hypot(sun[0], sun[1]);
  if (level < 1e-6 || sun[2] <= 0) return sun[2] <= 0 ? lit.fill(0) : lit;
  const byCols = Math.abs(sun[1]) <= Math.abs(sun[0]);
  const [along, across] = byCols ? [sun[0], sun[1]] : [sun[1], sun[0]];
  const [length, lines, walk, side] = byCols ? [wide, high, 1, wide] : [high, wide, wide, 1];
  // From one line to the next, away from the sun.
  const back = along < 0 ? -1 : 1, drift = (across / Math.abs(along)) * 1, way = (step * level) / Math.abs(along);
  const drop = way * (sun[2] / level), start = back < 0 ? 0 : length - 1;
  let distance = new Float32Array(lines), next = new Float32Array(lines);
  for (let i = 0, at = start; i < length; i++, at -= back, [distance, next] = [next, distance]) {
    for (let line = 0; line < lines; line++) {
      const place = at * walk + line * side, height = heights[place];
      let shadow = -Infinity;
      next[line] = 0;
      const from = line + drift, low = Math.floor(from);
      if (0 < i && 0 <= low && low + 1 < lines) {
        const share = from - low, before = (at + back) * walk;
        const a = top[before + low * side], b = top[before + (low + 1) * side];
        shadow = a + share * (b - a) - drop;
        next[line] = distance[low] + share * (distance[low + 1] - distance[low]) + way;
      }
      const soft = Math.max(SOFT * next[line], SOFT_POSTS * drop);
      lit[place] = Math.round(255 * Math.min(Math.max(0.5 - (shadow - height) / (2 * soft), 0), 1));
      if (shadow <= height) next[line] = 0;
      top[place] = Math.max(shadow, height);
    }
  }
  return lit;
}

/** The texels: rise to the east, rise to the north, sunlight, openness. `sun` points at it: east, north, up. */
export function texels(relief, sun) {
  const { wide, high, heights, step } = relief, data = new Uint8Array(4 * wide * high);
  const lit = sunlight(relief, sun);
  relief.mean ??= blurred(relief, Math.max(Math.round(AROUND_M / step), 1));
  for (let row = 0, i = 0; row < high; row++) {
    const [south, north] = [row === 0 ? 0 : wide, row === high - 1 ? 0 : wide];
    for (let col = 0; col < wide; col++, i++) {
      const [west, east] = [col === 0 ? 0 : 1, col === wide - 1 ? 0 : 1];
      const open = 0.85 + (heights[i] - relief.mean[i]) / (2 * HOLLOW_M);
      data[4 * i] = packed((heights[i + east] - heights[i - west]) / ((east + west) * step));
      data[4 * i + 1] = packed((heights[i + north] - heights[i - south]) / ((north + south) * step));
      data[4 * i + 2] = lit[i];
      data[4 * i + 3] = Math.round(255 * Math.min(Math.max(open, 0.74), 1));
    }
  }
  return data;
}
