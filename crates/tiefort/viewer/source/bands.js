// Where the bands of roads and streams join: as crates/terrain/src/bands.rs has it for pictures and exports.

/** Where a way turns by more than this cosine says, its bands are not mitred. */
const MITRE_COSINE_MIN = -0.3;
/** Sides of the disc that joins bands which are not mitred. */
const SIDES = 12;

const placeOf = ([east, north]) => `${east},${north}`;

/** The way from one place to another, and how far it is. */
function direction(from, to) {
  const [right, up] = [to[0] - from[0], to[1] - from[1]], length = Math.hypot(right, up) || 1;
  return [right / length, up / length, length];
}

/** From the middle of a way to its left side where it turns, in halves of its width; null where it turns back, or so
 * near to its next place that the inner side would reach beyond that. */
function mitre(before, at, after, half) {
  const [ax, ay, from] = direction(before, at), [bx, by, to] = direction(at, after);
  const cosine = ax * bx + ay * by, sine = ax * by - ay * bx;
  const hasRoom = half * Math.abs(sine) <= (1 + cosine) * Math.min(from, to);
  return MITRE_COSINE_MIN < cosine && hasRoom ? [-(ay + by) / (1 + cosine), (ax + bx) / (1 + cosine)] : null;
}

/** For each road, where the left side of its band lies from its middle at both ends, in halves of its width, and
 * whether a disc joins the band to others there. Of two bands that end in one place each goes on as the other. */
export function joined(roads, halfOf) {
  const ends = new Map();
  const keyOf = (road, end) => `${road.class} ${road.width} ${placeOf(road.ends[end])}`;
  for (const road of roads) {
    for (const end of [0, 1]) {
      const key = keyOf(road, end);
      if (!ends.has(key)) ends.set(key, []);
      ends.get(key).push([road, end]);
    }
  }
  return roads.map((road) => {
    const half = halfOf(road), [right, up] = direction(...road.ends), plain = [-up, right];
    return [0, 1].map((end) => {
      const there = ends.get(keyOf(road, end));
      const [other, its] = there.find(([each]) => each !== road) ?? [];
      if (there.length !== 2 || !other) return { left: plain, isDisc: true };
      const beyond = other.ends[1 - its], [a, b] = road.ends;
      const left = end === 0 ? mitre(beyond, a, b, half) : mitre(a, b, beyond, half);
      return { left: left ?? plain, isDisc: !left };
    });
  });
}

/** East and north from the middle of a disc to its corners, in halves of a width, counter-clockwise. */
export const DISC = Array.from({ length: SIDES }, (_, side) =>
  [Math.cos((2 * Math.PI * side) / SIDES), Math.sin((2 * Math.PI * side) / SIDES)]);
