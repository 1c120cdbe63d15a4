// The canvas with its renderer, scene and camera: all that needs no area, so that it is made while the server answers.
import { BufferAttribute, DirectionalLight, HemisphereLight, PerspectiveCamera, Scene, WebGLRenderer } from "three";
import * as looks from "./materials.js";
import { geometryOf, meshOf } from "./meshes.js";
import { Pace } from "./pace.js";

const EYE_DEGREES = 55, NEAR_M = 1, FAR_M = 500_000;
/** What the canvas shows before the first picture: the page's own background. */
const BACKGROUND = 0xcfccc5;

/** Renderer, scene, sky, camera and pace on a canvas of the page. */
export function drawingOn(canvas) {
  const { renderer, isSoft } = rendererOn(canvas), scene = new Scene(), sky = looks.skyMesh();
  const camera = new PerspectiveCamera(EYE_DEGREES, 1, NEAR_M, FAR_M), pace = new Pace(renderer, isSoft);
  const sun = new DirectionalLight(0xfff4e0, 2.3);
  sun.position.set(-1, 1.1, -1);
  scene.add(sun, new HemisphereLight(0xf0eee8, 0x77705c, 1.4));
  const drawing = { renderer, scene, sky, camera, pace };
  fitted(drawing);
  makeReady(drawing);
  return drawing;
}

function rendererOn(canvas) {
  const context = contextOf(canvas, false);
  if (drawsInSoftware(context)) return { renderer: new WebGLRenderer({ canvas, context }), isSoft: true };
  // A canvas keeps its first context: one whose edges are smoothed needs another.
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  const other = canvas.cloneNode();
  canvas.replaceWith(other);
  return { renderer: new WebGLRenderer({ canvas: other, context: contextOf(other, true) }), isSoft: false };
}

/** Nothing lies behind the picture, so that the browser need not look for it. */
const contextOf = (canvas, antialias) => canvas.getContext("webgl2", { alpha: false, antialias, stencil: false });

/** Whether there is no graphics hardware: then every sample of a pixel costs. */
function drawsInSoftware(context) {
  const names = context?.getExtension("WEBGL_debug_renderer_info");
  const name = names ? context.getParameter(names.UNMASKED_RENDERER_WEBGL) : "";
  return /swiftshader|llvmpipe|software/i.test(name);
}

/** Fills the window, whatever its size becomes. */
function fitted({ renderer, camera, pace }) {
  const fit = () => {
    renderer.setDrawingBufferSize(innerWidth, innerHeight, renderer.getPixelRatio());
    camera.aspect = innerWidth / innerHeight;
    camera.updateProjectionMatrix();
    pace.again();
  };
  addEventListener("resize", fit);
  fit();
}

/** Draws triangles without an extent, for which the shaders of the first picture are compiled: that takes a while, and
 * goes on beside what the page does meanwhile. */
function makeReady({ renderer, scene, sky, camera }) {
  renderer.setClearColor(BACKGROUND);
  const geometry = geometryOf(new Float32Array(9));
  geometry.setAttribute("normal", new BufferAttribute(new Float32Array(9), 3));
  const meshes = [looks.coarse, looks.walls, sky.material].map((material) => meshOf(geometry, material));
  meshes.forEach((mesh) => (mesh.frustumCulled = false));
  scene.add(...meshes);
  renderer.render(scene, camera);
  scene.remove(...meshes);
  geometry.dispose();
}
