// Run by `npm test` in the viewer's folder.
import assert from "node:assert";
import test from "node:test";
import { joined } from "./bands.js";
import { draped, groundOf, liesOn } from "./drape.js";

const road = (width, a, b) => ({ class: 1, width, ends: [[...a, 0], [...b, 0]] });
const halfOf = ({ width }) => width / 2;

test("bands of one way are mitred where it turns, whichever way its pieces run", () => {
  for (const ends of [[[100, 0], [100, 100]], [[100, 100], [100, 0]]]) {
    const [[start, end]] = joined([road(10, [0, 0], [100, 0]), road(10, ...ends)], halfOf);
    assert.deepStrictEqual(end, { left: [-1, 1], isDisc: false });
    assert.strictEqual(start.isDisc, true);
  }
});

test("unlike widths, ways that turn back and stretches without room are joined by discs", () => {
  const joins = (...roads) => !joined(roads, halfOf)[0][1].isDisc;
  const first = road(10, [0, 0], [100, 0]);
  assert.ok(joins(first, road(10, [100, 0], [200, 30])));
  assert.ok(!joins(first, road(7, [100, 0], [200, 30])));
  assert.ok(!joins(first, road(10, [100, 0], [0, 10])));
  assert.ok(!joins(first, road(10, [100, 0], [100, 3])));
});

test("a plan is cut along the triangles of a surface", () => {
  // A roof of 10 by 10 m whose ridge runs from corner to corner.
  const points = new Float32Array([0, 0, 5, 10, 0, 0, 10, 10, 5, 0, 10, 0]);
  const ground = groundOf({ points, triangles: [0, 1, 2, 0, 2, 3] });
  const plan = [[2, 2], [8, 2], [8, 8], [2, 8]], pieces = [...draped(ground, plan)];
  assert.deepStrictEqual(pieces.map((piece) => piece.length), [3, 3]);
  for (const [x, y, height] of pieces.flat()) assert.ok(Math.abs(height - (5 - Math.abs(x - y) / 2)) < 1e-9);
  assert.ok(liesOn(ground, plan) && !liesOn(ground, [[2, 2], [11, 2], [8, 8]]));
});
