// What lies at a place of a surface: {points, triangles}, x east, y north, z up.

/** The triangle of a surface under a place: its number, height and normal; null outside. */
export function triangleUnder(surface, east, north) {
  return trianglesUnder(surface, east, north).next().value ?? null;
}

/** The topmost triangle of decks at a place that is not above a ceiling; null where there is none. */
export function deckUnder(decks, east, north, ceiling) {
  let top = null;
  for (const deck of trianglesUnder(decks, east, north)) {
    if (deck.height <= ceiling && !(deck.height <= top?.height)) top = deck;
  }
  return top;
}

/** All triangles of a surface at a place. */
function* trianglesUnder(surface, east, north) {
  const { points, triangles } = surface;
  // On an edge rounding must not make a hole.
  const slack = 1e-6;
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
    const [ux, uy] = [points[b] - points[a], points[b + 1] - points[a + 1]];
    const [vx, vy] = [points[c] - points[a], points[c + 1] - points[a + 1]];
    const [px, py] = [east - points[a], north - points[a + 1]];
    const area = ux * vy - uy * vx;
    const s = (px * vy - py * vx) / area, w = (ux * py - uy * px) / area;
    if (s < -slack || w < -slack || 1 + slack < s + w) continue;
    const [uz, vz] = [points[b + 2] - points[a + 2], points[c + 2] - points[a + 2]];
    const normal = [uy * vz - uz * vy, uz * vx - ux * vz, area];
    const length = Math.hypot(...normal);
    const height = points[a + 2] + s * uz + w * vz;
    yield { number: t / 3, height, normal: normal.map((part) => part / length) };
  }
}

/** Height of the coarse grid's triangles at a place of the area. */
export function coarseUnder(area, east, north) {
  const { wide, high, heights } = area.coarse, step = area.side_m / area.coarse_steps;
  const [across, up] = [(east - area.sides[0]) / step, (north - area.sides[1]) / step];
  const [col, row] = [[across, wide], [up, high]].map(([at, end]) => Math.min(Math.max(Math.floor(at), 0), end - 2));
  const at = row * wide + col, [right, top] = [across - col, up - row];
  const [a, b, c, d] = [heights[at], heights[at + 1], heights[at + wide + 1], heights[at + wide]];
  return top <= right ? a + right * (b - a) + top * (c - b) : a + top * (d - a) + right * (c - d);
}

/** Height of a coarse grid at a place along one of its lines: `[row, col]` in coarse steps, one of them whole. */
export function coarseHeight({ wide, high, heights }, row, col) {
  const [r, c] = [Math.min(Math.floor(row), high - 1), Math.min(Math.floor(col), wide - 1)];
  const [next, share] = c < col ? [r * wide + c + 1, col - c] : [Math.min(r + 1, high - 1) * wide + c, row - r];
  const here = heights[r * wide + c];
  return here + share * (heights[next] - here);
}
