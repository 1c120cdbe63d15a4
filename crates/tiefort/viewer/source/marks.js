// Lines over the ground: what a tool was asked about. They are seen through hills.
import { BufferGeometry, Float32BufferAttribute, LineBasicMaterial, LineSegments } from "three";

/** Metres that a line lies above the ground it follows. */
const LIFT_M = 1;
const seenThrough = new LineBasicMaterial({ vertexColors: true, depthTest: false });

export class Marks {
  constructor(view) {
    this.view = view;
    this.lines = null;
  }

  clear() {
    if (!this.lines) return;
    this.view.scene.remove(this.lines);
    this.lines.geometry.dispose();
    this.lines = null;
    this.view.version += 1;
  }

  /** Draws pieces, each from a place to a place (east, north and height in the area's system) in a colour. */
  draw(pieces) {
    this.clear();
    const { area, scene } = this.view, positions = [], colors = [];
    for (const [from, to, color] of pieces) {
      for (const [east, north, height] of [from, to]) {
        const [x, y] = area.fromSystem(east, north);
        positions.push(x, height + LIFT_M, -y);
        colors.push(...color);
      }
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new Float32BufferAttribute(positions, 3));
    geometry.setAttribute("color", new Float32BufferAttribute(colors, 3));
    this.lines = new LineSegments(geometry, seenThrough);
    this.lines.frustumCulled = false;
    this.lines.renderOrder = 2;
    scene.add(this.lines);
    this.view.version += 1;
  }
}
