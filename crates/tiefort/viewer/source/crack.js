// Looks for holes in the ground: a picture with a sky that no ground has, of which none may be seen below the horizon.
import { Color, LinearSRGBColorSpace, Vector2, Vector3, WebGLRenderTarget } from "three";

/** Rays that look less than this below the horizontal may leave the earth. */
const BELOW = Math.sin((1 * Math.PI) / 180);

/** Pixels that look below the horizon, and how many of them see the sky. */
export function skyBelowHorizon({ renderer, scene, sky: heaven, camera }) {
  const { x: wide, y: high } = renderer.getDrawingBufferSize(new Vector2());
  const target = new WebGLRenderTarget(wide, high);
  scene.background = new Color().setRGB(1, 0, 1, LinearSRGBColorSpace);
  heaven.visible = false;
  renderer.setRenderTarget(target);
  renderer.render(scene, camera);
  const pixels = new Uint8Array(4 * wide * high);
  renderer.readRenderTargetPixels(target, 0, 0, wide, high, pixels);
  renderer.setRenderTarget(null);
  target.dispose();
  scene.background = null;
  heaven.visible = true;
  let [below, sky] = [0, 0];
  const places = [], rays = raysOf(camera), ray = new Vector3();
  for (let y = 0; y < high; y++) {
    for (let x = 0; x < wide; x++) {
      rays(ray, (x + 0.5) / wide, (y + 0.5) / high);
      if (-BELOW * ray.length() < ray.y) continue;
      below += 1;
      const at = 4 * (y * wide + x);
      if (200 < pixels[at] && pixels[at + 1] < 50 && 200 < pixels[at + 2]) {
        sky += 1;
        if (places.length < 10) places.push([x, high - 1 - y]);
      }
    }
  }
  return { below, sky, places };
}

/** Tells the ray of a place in the picture, both from 0 to 1: between those of three corners it changes evenly. */
function raysOf(camera) {
  const corner = (x, y) => new Vector3(x, y, 0.5).unproject(camera).sub(camera.position);
  const start = corner(-1, -1), right = corner(1, -1).sub(start), up = corner(-1, 1).sub(start);
  return (ray, x, y) => ray.copy(start).addScaledVector(right, x).addScaledVector(up, y);
}
