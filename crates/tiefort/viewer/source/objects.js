// What stands in a load module: read from the part *objects* of its file (docs/FORMAT.md), and what is in the way of a
// vehicle there.
const QUANTA = 128;
/** Kinds by their numbers in a file; the first three are prisms. */
export const KINDS = ["building", "tower", "wall", "wood", "scrub", "orchard", "row"];

/** The prisms and canopies of a part in the square of a load module with sides of `side` metres whose south-west corner
 * is at a place: heights in metres, prisms as blocks.js takes them, canopies with the corners of their triangles. */
export function objectsAt(bytes, start, [west, south], side) {
  const view = new DataView(bytes, start);
  const u16 = (at) => view.getUint16(at, true), u32 = (at) => view.getUint32(at, true);
  const [prismCount, canopyCount, ringCount, cornerCount, placeCount, triangleCount] =
    Array.from({ length: 6 }, (_, i) => u32(4 * i));
  // Numbers that a float holds are enough to tell objects apart.
  const idAt = (at) => u32(at) + (u32(at + 4) & 0x1fffff) * 2 ** 32;
  const prismsAt = 24, canopiesAt = prismsAt + 20 * prismCount, cornersAt = canopiesAt + 20 * canopyCount;
  const placesAt = cornersAt + 4 * cornerCount, ringsAt = placesAt + 4 * placeCount;
  const trianglesAt = ringsAt + 2 * ringCount, wallsAt = trianglesAt + 6 * triangleCount;
  const place = (at) => ({ x: west + u16(at) / QUANTA, y: south + u16(at + 2) / QUANTA });
  let [ring, corner, from, triangle] = [0, 0, 0, 0];
  const prisms = Array.from({ length: prismCount }, (_, i) => {
    const at = prismsAt + 20 * i;
    const rings = Array.from({ length: u16(at + 18) }, () => Array.from({ length: u16(ringsAt + 2 * ring++) }, () => {
      const isOpen = view.getUint8(wallsAt + corner) === 0;
      return { ...place(cornersAt + 4 * corner++), isOpen };
    }));
    const [floor, roof] = [8, 12].map((word) => view.getInt32(at + word, true) / QUANTA);
    return { id: idAt(at), kind: KINDS[view.getUint8(at + 16)], floor, roof, rings, box: boxOf(rings[0]) };
  });
  const canopies = Array.from({ length: canopyCount }, (_, i) => {
    const at = canopiesAt + 20 * i, count = u32(at + 8);
    const corners = Array.from({ length: u16(at + 18) }, (_, i) => place(placesAt + 4 * (from + i)));
    const triangles = Array.from({ length: 3 * count }, (_, i) => u16(trianglesAt + 6 * triangle + 2 * i));
    [from, triangle] = [from + corners.length, triangle + count];
    const [height, spacing] = [u16(at + 14), u16(at + 16)].map((quanta) => quanta / QUANTA);
    return { id: idAt(at), kind: KINDS[view.getUint8(at + 12)], height, spacing, corners, triangles,
      box: boxOf(corners) };
  });
  return { prisms, canopies, box: [west, south, west + side, south + side] };
}

function boxOf(places) {
  const [xs, ys] = [places.map(({ x }) => x), places.map(({ y }) => y)];
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
}

const reaches = ([west, south, east, north], x, y, radius) =>
  west - radius <= x && x <= east + radius && south - radius <= y && y <= north + radius;

/** What a vehicle that stands `low` and reaches up to `high` has within a radius: the kind of a prism it touches, or
 * null, and the canopies over its middle. */
export function metAt({ prisms, canopies }, x, y, radius, low, high) {
  const isMet = ({ box, floor, roof, rings }) => low < roof && floor < high && reaches(box, x, y, radius)
    && (isInside(rings, x, y) || rings.some((ring) => isNear(ring, x, y, radius)));
  return {
    prism: prisms.find(isMet)?.kind ?? null,
    woods: canopies.filter((canopy) => reaches(canopy.box, x, y, 0) && covers(canopy, x, y)),
  };
}

/** The prism at a place of a roof or a wall. */
export function prismAt(prisms, x, y, height) {
  const near = 0.05;
  const isThere = ({ box, floor, roof, rings }) => floor - near <= height && height <= roof + near
    && reaches(box, x, y, near) && (isInside(rings, x, y) || rings.some((ring) => isNear(ring, x, y, near)));
  return prisms.find(isThere) ?? null;
}

function isInside(rings, x, y) {
  let inside = false;
  for (const ring of rings) {
    ring.forEach((a, i) => {
      const b = ring[(i + 1) % ring.length];
      if ((a.y <= y) !== (b.y <= y) && x < a.x + ((y - a.y) / (b.y - a.y)) * (b.x - a.x)) inside = !inside;
    });
  }
  return inside;
}

/** Whether a wall of a ring is that near. */
function isNear(ring, x, y, radius) {
  return ring.some((a, i) => {
    if (a.isOpen) return false;
    const b = ring[(i + 1) % ring.length], [runX, runY] = [b.x - a.x, b.y - a.y];
    const along = ((x - a.x) * runX + (y - a.y) * runY) / (runX * runX + runY * runY || 1);
    const share = Math.min(Math.max(along, 0), 1);
    return Math.hypot(a.x + share * runX - x, a.y + share * runY - y) < radius;
  });
}

function covers({ corners, triangles }, x, y) {
  const left = (a, b) => 0 <= (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [corners[triangles[t]], corners[triangles[t + 1]], corners[triangles[t + 2]]];
    if (left(a, b) && left(b, c) && left(c, a)) return true;
  }
  return false;
}
