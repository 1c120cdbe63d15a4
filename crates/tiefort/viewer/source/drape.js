// What follows a surface: plans are cut along its triangles.

/** West, south, east and north of places, four numbers for every three. */
export function boxesOf(count, x, y) {
  const boxes = new Float32Array(4 * count);
  for (let t = 0; t < count; t++) {
    const [xs, ys] = [x, y].map((of) => [of(3 * t), of(3 * t + 1), of(3 * t + 2)]);
    boxes.set([Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)], 4 * t);
  }
  return boxes;
}

/** The triangles of a surface with the boxes around them. */
export function groundOf({ points, triangles }) {
  const at = (axis) => (corner) => points[3 * triangles[corner] + axis];
  return { points, triangles, boxes: boxesOf(triangles.length / 3, at(0), at(1)) };
}

/** The pieces of a convex plan, counter-clockwise, on each triangle of a surface: corners [east, north, height]. */
export function* draped({ points, triangles, boxes }, plan) {
  const [xs, ys] = [0, 1].map((axis) => plan.map((place) => place[axis]));
  const [west, south, east, north] = [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
  for (let g = 0; g < boxes.length; g += 4) {
    if (east <= boxes[g] || north <= boxes[g + 1] || boxes[g + 2] <= west || boxes[g + 3] <= south) continue;
    let piece = [0, 1, 2].map((i) => {
      const vertex = 3 * triangles[(3 * g) / 4 + i];
      return [...points.subarray(vertex, vertex + 3)];
    });
    for (let side = 0; side < plan.length && 2 < piece.length; side++) {
      piece = leftOf(plan[side], plan[(side + 1) % plan.length], piece);
    }
    if (2 < piece.length) yield piece;
  }
}

/** What of a convex piece lies left of the line from `a` to `b`. */
function leftOf(a, b, piece) {
  const kept = [], sides = piece.map(([x, y]) => (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]));
  piece.forEach((from, i) => {
    const next = (i + 1) % piece.length, [here, there] = [sides[i], sides[next]];
    if (0 <= here) kept.push(from);
    if (0 <= here * there) return;
    kept.push(from.map((value, axis) => value + (here / (here - there)) * (piece[next][axis] - value)));
  });
  return kept;
}

/** Whether a plan lies on a surface that fills a square, and not partly beyond its sides. */
export function liesOn({ boxes }, plan) {
  const ends = [0, 1, 2, 3].map((side) => {
    let end = boxes[side];
    for (let g = side; g < boxes.length; g += 4) end = side < 2 ? Math.min(end, boxes[g]) : Math.max(end, boxes[g]);
    return end;
  });
  return plan.every(([x, y]) => ends[0] <= x && ends[1] <= y && x <= ends[2] && y <= ends[3]);
}
