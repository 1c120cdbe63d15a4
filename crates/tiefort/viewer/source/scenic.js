// Where to begin: the place and the direction with the most relief in view.
import { isWater } from "./colors.js";

/** Places along a side that are tried, directions from each, rays in each view and places along a ray. */
const TRIED = 36, DIRECTIONS = 12, RAYS = 7, LOOKS = 14;
const VIEW_RADIANS = 0.85, REACH_M = 9000, ABOVE_M = 160;
/** How much a place that sees water gains. */
const SHORE = 0.035;

/** Height of the coarse grid near a place; undefined outside. */
export function coarseAt(area, east, north) {
  const { wide, high, heights } = area.coarse, step = area.side_m / area.coarse_steps;
  const [col, row] = [Math.round((east - area.sides[0]) / step), Math.round((north - area.sides[1]) / step)];
  return 0 <= row && 0 <= col && row < high && col < wide ? heights[row * wide + col] : undefined;
}

function isWaterAt({ coarse, ...area }, east, north) {
  const step = area.side_m / area.coarse_steps;
  const [col, row] = [Math.round((east - area.sides[0]) / step), Math.round((north - area.sides[1]) / step)];
  return isWater(area, coarse.classes[row * coarse.wide + col]);
}

/** What is seen from a place: how much the heights in view differ, less what lies outside. */
function score(area, [east, north], eye, direction, reach) {
  let [seen, sum, squares, outside, water] = [0, 0, 0, 0, 0];
  for (let ray = 0; ray < RAYS; ray++) {
    const way = direction + VIEW_RADIANS * (ray / (RAYS - 1) - 0.5), [sin, cos] = [Math.sin(way), Math.cos(way)];
    let horizon = -Infinity;
    for (let look = 1; look <= LOOKS; look++) {
      const away = (reach * look * look) / (LOOKS * LOOKS) + 100;
      const height = coarseAt(area, east + sin * away, north + cos * away);
      if (height === undefined) {
        outside += 1;
        continue;
      }
      const rise = (height - eye) / away;
      if (rise < horizon) continue;
      if (isWaterAt(area, east + sin * away, north + cos * away)) water += 1;
      horizon = rise;
      // Peaks above the eye count more than depths below.
      const counted = eye < height ? eye + 1.6 * (height - eye) : height;
      [seen, sum, squares] = [seen + 1, sum + counted, squares + counted * counted];
    }
  }
  if (seen < RAYS) return 0;
  const relief = Math.sqrt(Math.max(squares / seen - (sum / seen) ** 2, 0));
  // Light comes from the north-west: ground looks best with it from behind or from the side.
  const shores = 1 + Math.min(water, 12) * SHORE;
  return relief * shores * (1 - (0.8 * outside) / (RAYS * LOOKS)) * (1 + 0.2 * Math.sin(direction - Math.PI / 4));
}

/** East, north, height of the eye and heading. */
export function scenicPlace(area) {
  const [west, south, east, north] = area.sides, reach = Math.min(REACH_M, 0.6 * Math.min(east - west, north - south));
  let best = { score: -1 };
  for (let row = 0; row < TRIED; row++) {
    for (let col = 0; col < TRIED; col++) {
      const share = (at) => 0.05 + (0.9 * at) / (TRIED - 1);
      const place = [west + share(col) * (east - west), south + share(row) * (north - south)];
      const ground = coarseAt(area, ...place);
      if (!(ground !== undefined)) continue;
      for (let number = 0; number < DIRECTIONS; number++) {
        const direction = (2 * Math.PI * number) / DIRECTIONS, found = score(area, place, ground + ABOVE_M, direction, reach);
        if (best.score < found) best = { score: found, place, direction, ground };
      }
    }
  }
  if (!best.place) return { east: 0, north: 0, altitude: (coarseAt(area, 0, 0) ?? 0) + ABOVE_M, heading: 0 };
  // Clear of what lies just ahead.
  const [sin, cos] = [Math.sin(best.direction), Math.cos(best.direction)];
  const ahead = [0, 300, 600, 900, 1200].map((away) =>
    coarseAt(area, best.place[0] + sin * away, best.place[1] + cos * away) ?? best.ground);
  return { east: best.place[0], north: best.place[1], altitude: Math.max(...ahead) + ABOVE_M, heading: best.direction };
}
