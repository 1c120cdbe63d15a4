// Shadows that blocks cast on the ground and on each other: their depth as the sun sees it, around the observer.
import {
  BackSide, DepthTexture, FloatType, GLSL3, LessEqualCompare, LinearFilter, Matrix4, OrthographicCamera, ShaderMaterial,
  Vector4, WebGLRenderTarget,
} from "three";
import { setCasts } from "./materials.js";
import { CASTS } from "./blocks.js";

/** Metres each way that have shadows, and that the observer goes before they are drawn anew. */
const REACH_M = 900, MOVE_M = 150;
/** Texels a side, and how deep along the light blocks may lie. */
const TEXELS = 2048, DEEP_M = 4000;
/** How much more than that is drawn each way: blocks beyond it cast shadows into it. */
const ROOM = 1.25;
/** The lowest sun, by the sine of its height, that casts shadows: lower ones are longer than what is drawn. */
const SUN_MIN = 0.03;
/** Milliseconds between two pictures of the shadows while load modules come. */
const EVERY_MS = 500;

export class Casts {
  constructor() {
    this.camera = new OrthographicCamera();
    this.camera.layers.set(CASTS);
    this.material = new ShaderMaterial({
      glslVersion: GLSL3, side: BackSide, vertexShader: VERTEX,
      fragmentShader: "out vec4 seen; void main() { seen = vec4(1.0); }",
    });
    this.place = new Matrix4();
    [this.drawn, this.last] = ["", -Infinity];
  }

  /** Draws them anew where blocks, sun or observer have moved. */
  draw({ renderer, scene, houses, terrain, tank, sun }, now) {
    const isUp = sun && SUN_MIN < sun[2] && 0 < houses.counts().drawn + terrain.counts().drawn;
    if (!isUp) {
      if (this.drawn !== "") setCasts(null);
      this.drawn = "";
      return;
    }
    const round = (place) => MOVE_M * Math.round(place / MOVE_M), [x, y] = [round(tank.east), round(tank.north)];
    const wanted = `${houses.stock} ${terrain.stock} ${x} ${y} ${sun}`;
    if (wanted === this.drawn || (0 < terrain.asked.size && now < this.last + EVERY_MS)) return;
    [this.drawn, this.last] = [wanted, now];
    this.target ??= targetOf();
    const { camera, target } = this, height = tank.height ?? 0, half = ROOM * REACH_M;
    Object.assign(camera, { left: -half, right: half, top: half, bottom: -half, near: 0, far: 2 * DEEP_M });
    camera.position.set(x + DEEP_M * sun[0], height + DEEP_M * sun[2], -(y + DEEP_M * sun[1]));
    camera.lookAt(x, height, -y);
    camera.updateMatrixWorld();
    camera.updateProjectionMatrix();
    const before = renderer.getRenderTarget();
    scene.overrideMaterial = this.material;
    renderer.setRenderTarget(target);
    renderer.clear();
    renderer.render(scene, camera);
    renderer.setRenderTarget(before);
    scene.overrideMaterial = null;
    // From -1 to 1 to that of a texture, 0 to 1.
    this.place.set(0.5, 0, 0, 0.5, 0, 0.5, 0, 0.5, 0, 0, 0.5, 0.5, 0, 0, 0, 1)
      .multiply(camera.projectionMatrix).multiply(camera.matrixWorldInverse);
    setCasts({ map: target.depthTexture, place: this.place, reach: new Vector4(x, -y, REACH_M, 1) });
  }
}

function targetOf() {
  const depthTexture = new DepthTexture(TEXELS, TEXELS, FloatType);
  depthTexture.magFilter = depthTexture.minFilter = LinearFilter;
  depthTexture.compareFunction = LessEqualCompare;
  return new WebGLRenderTarget(TEXELS, TEXELS, { depthTexture });
}

const VERTEX = /* glsl */ `
  void main() { gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }
`;
