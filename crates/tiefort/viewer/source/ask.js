// What is asked of the server about places: all of them in the area's own system, metres.
import { forward, toPoint } from "mgrs";
import { answer } from "./server.js";

const words = (numbers) => numbers.map((number) => String(Number(number.toFixed(3)))).join(",");

/** Whether one place sees another, both with metres above the ground; `how` says which objects are looked at, and
 * whether the earth is round. */
export async function askSight(from, to, how) {
  const body = JSON.stringify({ lines: [[...from, ...to]], above_ground: true, ...how });
  const request = { method: "POST", headers: { "Content-Type": "application/json" }, body };
  return (await (await answer("/line-of-sight", request)).json()).lines[0];
}

/** Heights along a line. */
export const askProfile = async (from, to, spacing) =>
  (await answer(`/profile?from=${words(from)}&to=${words(to)}&spacing_m=${spacing.toFixed(3)}`)).json();

/** What is seen around a place: places along a side, metres between them, and bytes from the north-west. */
export async function askViewshed(from, target, range, spacing, how) {
  const asked = { from: words(from), target_m: target, range_m: range, spacing_m: spacing, ...how };
  const bytes = await (await answer(`/viewshed?${new URLSearchParams(asked)}`)).arrayBuffer();
  const [side] = new Uint32Array(bytes, 0, 1);
  return { side, spacing, seen: new Uint8Array(bytes, 8, side * side) };
}

/** A place of coordinates as people write them: of the area's system, degrees, UTM or MGRS. */
export async function askPlace(written) {
  const plain = written.trim(), close = plain.replace(/\s/g, "").toUpperCase();
  let asked = plain;
  if (/^\d{1,2}[C-X][A-Z]{2}(\d\d){1,5}$/.test(close)) {
    const [longitude, latitude] = toPoint(close);
    asked = `${latitude} ${longitude}`;
  }
  return (await (await answer(`/api/find/${encodeURIComponent(asked)}`)).json()).place_m;
}

/** Places whose degrees are asked for at once. */
const DEGREES_MAX = 100;

/** Longitude and latitude of places. */
export async function askDegrees(places) {
  const found = [];
  for (let i = 0; i < places.length; i += DEGREES_MAX) {
    const part = places.slice(i, i + DEGREES_MAX).map(words).join(";");
    found.push(...(await (await answer(`/api/degrees/${part}`)).json()));
  }
  return found;
}

/** Degrees and MGRS of a place. */
export async function askWhere(place) {
  const { longitude, latitude } = await (await answer(`/api/where/${words(place)}`)).json();
  return { longitude, latitude, mgrs: Math.abs(latitude) < 80 ? forward([longitude, latitude], 4) : "" };
}
