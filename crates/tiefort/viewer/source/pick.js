// What is under the pointer: a triangle of a load module, or ground that is drawn coarsely.
import {
  BufferGeometry, Float32BufferAttribute, LineBasicMaterial, LineLoop, Raycaster, Vector2,
} from "three";
import { showPicked } from "./panel.js";

const outlined = new LineBasicMaterial({ color: 0xff3d9a, depthTest: false });

/** Where a ray through a point of the window meets the ground. */
export function hitAt({ camera, terrain }, x, y) {
  const rays = new Raycaster();
  rays.setFromCamera(new Vector2((2 * x) / innerWidth - 1, 1 - (2 * y) / innerHeight), camera);
  const meshes = [...terrain.drawn.values()].map(({ mesh }) => mesh);
  return rays.intersectObjects([...meshes, ...terrain.coarse.group.children], false)[0];
}

/** Reads the triangle under the pointer, and outlines it. */
export function pick(view, x, y) {
  const { area, scene, terrain } = view, hit = hitAt(view, x, y);
  unpick(view);
  if (!hit) return;
  const place = [hit.point.x, -hit.point.z, hit.point.y], [row, col] = area.moduleAt(place[0], place[1]);
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
