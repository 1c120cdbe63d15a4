// What is under the pointer: a triangle of a load module, or ground that is drawn coarsely.
import {
  BufferGeometry, Float32BufferAttribute, LineBasicMaterial, LineLoop, Raycaster, Vector2,
} from "three";
import { prismAt } from "./objects.js";
import { showPicked } from "./panel.js";

const outlined = new LineBasicMaterial({ color: 0xff3d9a, depthTest: false });

/** Where a ray through a point of the window meets the ground, a deck or a block that stands there. */
export function hitAt({ camera, terrain }, x, y) {
  const rays = new Raycaster();
  rays.setFromCamera(new Vector2((2 * x) / innerWidth - 1, 1 - (2 * y) / innerHeight), camera);
  const blocks = terrain.showsObjects ? [...terrain.drawn.values()].map(({ stands }) => stands?.block) : [];
  const meshes = [...terrain.drawn.values()].flatMap(({ mesh, decks }) => [mesh, decks]);
  const all = [...meshes, ...blocks, ...terrain.coarse.group.children];
  return rays.intersectObjects(all.filter(Boolean), false)[0];
}

/** A hit on a wall is met a hand's breadth before it. */
const BEFORE_M = 0.1;

/** The place of a hit, and how far it lies above the ground; `isWall` where nothing can stand on it. */
export function placeOf({ terrain }, { point, face }) {
  const isWall = Math.abs(face.normal.y) < 0.1, off = isWall ? BEFORE_M : 0;
  const [east, north] = [point.x + off * face.normal.x, -point.z - off * face.normal.z];
  return { east, north, isWall, above: terrain.aboveGround(east, north, point.y) };
}

/** What stands, or hangs, where a ray met no ground, in words; null where it met the ground. */
function thingAt(terrain, { object, point }) {
  const deckOf = object.userData.deckOf;
  if (deckOf !== undefined) return "deck of a bridge";
  const stands = [...terrain.drawn.values()].map((drawn) => drawn.stands).find((stands) => stands?.block === object);
  if (!stands) return null;
  const prism = prismAt(stands.prisms, point.x, -point.z, point.y);
  return prism ? `${prism.kind}, ${(prism.roof - prism.floor).toFixed(1)} m high` : "building";
}

/** Reads the triangle under the pointer, and outlines it, or what stands there. */
export function pick(view, x, y) {
  const { area, scene, terrain } = view, hit = hitAt(view, x, y);
  unpick(view);
  if (!hit) return;
  const place = [hit.point.x, -hit.point.z, hit.point.y], [row, col] = area.moduleAt(place[0], place[1]);
  const thing = thingAt(terrain, hit);
  if (thing) {
    view.picked = { row, col, place, thing, above: placeOf(view, hit).above };
    return showPicked(area, view.picked);
  }
  const found = terrain.drawn.get(hit.object.userData.key);
  if (!found) return showPicked(area, { row, col, place });
  const { module, surface } = found, number = hit.faceIndex, positions = [];
  for (const vertex of surface.triangles.subarray(3 * number, 3 * number + 3)) {
    const [east, north, up] = surface.points.subarray(3 * vertex, 3 * vertex + 3);
    positions.push(east, up + 0.4, -north);
  }
  const outline = new BufferGeometry().setAttribute("position", new Float32BufferAttribute(positions, 3));
  view.outline = new LineLoop(outline, outlined);
  scene.add(view.outline);
  view.version += 1;
  const normal = [hit.face.normal.x, -hit.face.normal.z, hit.face.normal.y];
  const isTin = surface === module.tin;
  const ofClass = isTin ? module.classes[number] : undefined;
  const className = ofClass === area.hole ? "hole" : (area.classes[ofClass] ?? ofClass);
  const residual = isTin ? undefined : surface.residuals[nearest(surface, number, place)];
  const { row: ownRow, col: ownCol, level } = module;
  view.picked = { row: ownRow, col: ownCol, level, place, triangle: { number, normal, className, residual } };
  showPicked(area, view.picked);
}

/** Forgets what was clicked. */
export function unpick(view) {
  if (view.outline) {
    view.scene.remove(view.outline);
    view.outline.geometry.dispose();
    view.version += 1;
  }
  view.outline = view.picked = undefined;
  showPicked(view.area, null);
}

/** The corner of a triangle that a place is nearest to. */
function nearest({ points, triangles }, number, [east, north]) {
  const away = (vertex) => Math.hypot(points[3 * vertex] - east, points[3 * vertex + 1] - north);
  return [...triangles.subarray(3 * number, 3 * number + 3)].reduce((a, b) => (away(b) < away(a) ? b : a));
}
