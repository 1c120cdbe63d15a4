// Where to begin: the place and the direction with the most relief in view.
import { isWater } from "./colors.js";

/** Places along a side that are tried, directions from each, rays in each view and places along a ray. */
const TRIED = 36, DIRECTIONS = 12, RAYS = 7, LOOKS = 14;
const VIEW_RADIANS = 0.85, REACH_M = 9000, ABOVE_M = 160;
/** How much a place that sees water gains. */
const SHORE = 0.035;
/** How much a place that sees towns gains at most: between such distances, a load module with so many pieces of roads
 * is one. */
const TOWN = 3, TOWN_M = [700, 3000], TOWN_ROADS = 60, TOWN_SEEN = 6;
/** Metres that ground a kilometre around should differ. */
const ROUGH_M = 250;

/** Height of the coarse grid near a place; undefined outside. */
export function coarseAt({ coarse: { wide, high, heights }, sides, side_m, coarse_steps }, east, north) {
  const step = side_m / coarse_steps;
  const [col, row] = [Math.round((east - sides[0]) / step), Math.round((north - sides[1]) / step)];
  return 0 <= row && 0 <= col && row < high && col < wide ? heights[row * wide + col] : undefined;
}

/** What does not change from place to place: the coarse grid, whether a class is water, and for each direction its rays
 * as steps of the grid to the places that are looked at. */
function views(area, reach) {
  const step = area.side_m / area.coarse_steps;
  const isWet = Array.from({ length: 256 }, (_, ofClass) => isWater(area, ofClass));
  // Close together near the eye.
  const distances = Array.from({ length: LOOKS }, (_, look) => (reach * (look + 1) ** 2) / (LOOKS * LOOKS) + 100);
  const directions = Array.from({ length: DIRECTIONS }, (_, number) => (2 * Math.PI * number) / DIRECTIONS);
  const raysOf = (direction) => Array.from({ length: RAYS }, (_, ray) => {
    const way = direction + VIEW_RADIANS * (ray / (RAYS - 1) - 0.5);
    return distances.map((away) => ({ away, right: (away * Math.sin(way)) / step, up: (away * Math.cos(way)) / step }));
  });
  const { rows, cols, coarse_steps: steps, lines } = area, busy = new Float32Array(rows * cols);
  for (const [key, roads] of lines) busy[key] = Math.min(roads.length / TOWN_ROADS, 1) ** 2;
  const town = (row, col) =>
    busy[Math.min(Math.floor(row / steps), rows - 1) * cols + Math.min(Math.floor(col / steps), cols - 1)];
  return directions.map((direction) => ({ ...area.coarse, isWet, town, direction, rays: raysOf(direction) }));
}

/** What is seen from a place of the grid: how far the ground in view goes up and down, and how high it stands. */
function score({ wide, high, heights, classes, isWet, town, direction, rays }, [across, along], eye) {
  let [relief, skyline, outside, water, towns] = [0, 0, 0, 0, 0];
  for (const ray of rays) {
    let [horizon, before] = [-0.3, undefined];
    for (const { away, right, up } of ray) {
      const col = Math.round(across + right), row = Math.round(along + up);
      if (row < 0 || col < 0 || high <= row || wide <= col) {
        outside += 1;
        continue;
      }
      const index = row * wide + col, height = heights[index], rise = (height - eye) / away;
      if (rise < horizon) continue;
      horizon = rise;
      relief += Math.abs(height - (before ?? height));
      before = height;
      if (isWet[classes[index]]) water += 1;
      if (TOWN_M[0] < away && away < TOWN_M[1]) towns += town(row, col);
    }
    skyline += Math.min(horizon, 0.25) / RAYS;
  }
  // Light comes from the north-west: ground looks best with it from the side.
  const bySide = 1 + 0.3 * Math.abs(Math.sin(direction + Math.PI / 4)), shores = 1 + Math.min(water, 12) * SHORE;
  const lived = 1 + TOWN * Math.min(towns / TOWN_SEEN, 1);
  const open = 1 - (0.8 * outside) / (RAYS * LOOKS);
  return relief * shores * lived * bySide * (0.3 + Math.max(skyline + 0.05, 0) * 4) * open;
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
  const all = views(area, reach), step = area.side_m / area.coarse_steps;
  let best = { score: -1 };
  for (let row = 0; row < TRIED; row++) {
    for (let col = 0; col < TRIED; col++) {
      const share = (at) => 0.05 + (0.9 * at) / (TRIED - 1);
      const place = [west + share(col) * (east - west), south + share(row) * (north - south)];
      const ground = coarseAt(area, ...place);
      if (ground === undefined) continue;
      const rough = 0.3 + Math.min(roughness(area, place) / ROUGH_M, 1);
      const onGrid = [(place[0] - west) / step, (place[1] - south) / step];
      for (const view of all) {
        const found = rough * score(view, onGrid, ground + ABOVE_M);
        if (best.score < found) best = { score: found, place, direction: view.direction, ground };
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
