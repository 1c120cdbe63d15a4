// Where to begin: the place and the direction with the most relief in view.
import { isWater } from "./colors.js";

/** Places along a side that are tried, directions from each, rays in each view and places along a ray. */
const TRIED = 36, DIRECTIONS = 12, RAYS = 7, LOOKS = 14;
const VIEW_RADIANS = 0.85, REACH_M = 9000, ABOVE_M = 160;
/** How much a place that sees water gains. */
const SHORE = 0.035;
/** Metres that ground a kilometre around should differ. */
const ROUGH_M = 250;

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

/** What is seen from a place: how far the ground in view goes up and down, and how high it stands. */
function score(area, [east, north], eye, direction, reach) {
  let [relief, skyline, outside, water] = [0, 0, 0, 0];
  for (let ray = 0; ray < RAYS; ray++) {
    const way = direction + VIEW_RADIANS * (ray / (RAYS - 1) - 0.5), [sin, cos] = [Math.sin(way), Math.cos(way)];
    let [horizon, before] = [-0.3, undefined];
    for (let look = 1; look <= LOOKS; look++) {
      const away = (reach * look * look) / (LOOKS * LOOKS) + 100;
      const height = coarseAt(area, east + sin * away, north + cos * away);
      if (height === undefined) {
        outside += 1;
        continue;
      }
      const rise = (height - eye) / away;
      if (rise < horizon) continue;
      horizon = rise;
      relief += Math.abs(height - (before ?? height));
      before = height;
      if (isWaterAt(area, east + sin * away, north + cos * away)) water += 1;
    }
    skyline += Math.min(horizon, 0.25) / RAYS;
  }
  // Light comes from the north-west: ground looks best with it from the side.
  const bySide = 1 + 0.3 * Math.abs(Math.sin(direction + Math.PI / 4)), shores = 1 + Math.min(water, 12) * SHORE;
  return relief * shores * bySide * (0.3 + Math.max(skyline + 0.05, 0) * 4) * (1 - (0.8 * outside) / (RAYS * LOOKS));
}

/** How much the heights a kilometre around a place differ. */
function roughness(area, [east, north]) {
  const heights = Array.from({ length: 12 }, (_, i) =>
    coarseAt(area, east + 1000 * Math.sin(i), north + 1000 * Math.cos(i))).filter((height) => height !== undefined);
  return heights.length < 8 ? 0 : Math.max(...heights) - Math.min(...heights);
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
      const rough = 0.3 + Math.min(roughness(area, place) / ROUGH_M, 1);
      for (let number = 0; number < DIRECTIONS; number++) {
        const direction = (2 * Math.PI * number) / DIRECTIONS;
        const found = rough * score(area, place, ground + ABOVE_M, direction, reach);
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
