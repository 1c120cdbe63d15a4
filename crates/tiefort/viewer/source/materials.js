// The look of ground and sky: one material for everything that lies on the ground, near or far, and what they share.
import {
  BackSide, BoxGeometry, Color, DataArrayTexture, DataTexture,
  DoubleSide, GLSL3, LinearFilter, LinearMipmapNearestFilter, Mesh,
  Matrix4, RGBAFormat, ShaderMaterial, Vector2, Vector3, Vector4,
} from "three";
import { numbers } from "./colors.js";
import { noiseTexture } from "./noise.js";
import { RIBBON_VERTEX } from "./ribbon_shader.js";
import { GROUND_FRAGMENT, GROUND_VERTEX, PICTURE_LEVELS_MAX, SKY_FRAGMENT, SKY_VERTEX } from "./shaders.js";
import { LEAVES_VERTEX, TREE_VERTEX, WALL_VERTEX } from "./standing_shaders.js";
import { lightOf } from "./sun.js";

/** Metres at which two thirds of what is seen are haze. */
const HAZE_M = 38_000;
/** Part of the shade that comes from the smooth relief where facets are near. */
const SOFTNESS = 0.72;

const flat = new DataTexture(new Uint8Array([128, 128, 255, 255]), 1, 1, RGBAFormat);
const clear = new DataTexture(new Uint8Array(4), 1, 1, RGBAFormat);
const noPicture = new DataArrayTexture(new Uint8Array(4), 1, 1, 1);
flat.needsUpdate = clear.needsUpdate = noPicture.needsUpdate = true;

let changes = 0;
/** A number that changes with what is set here. */
export const version = () => changes;
/** Says that something else was set. */
export const changed = () => (changes += 1);

const shared = {
  sunWay: { value: new Vector3(0, 1, 0) }, sunTint: { value: new Color() }, skyTint: { value: new Color() },
  hazeTint: { value: new Color() }, glowTint: { value: new Color() }, hazeM: { value: HAZE_M },
  rockTint: { value: new Color() }, topTint: { value: new Color() }, edgeTint: { value: new Color(0.06, 0.08, 0.09) },
  reliefMap: { value: flat }, reliefPlace: { value: new Vector4() }, noiseMap: { value: null },
  overMap: { value: clear }, overPlace: { value: new Vector4(0, 0, 1, 0) },
  smoothM: { value: new Vector2(1500, 3000) }, softness: { value: SOFTNESS }, seconds: { value: 0 },
  split: { value: new Vector2() }, splitSide: { value: 0 },
  leavesM: { value: new Vector3() }, blob: { value: new Vector4() },
  castMap: { value: null }, castPlace: { value: new Matrix4() },
  castReach: { value: new Vector4() },
  pictureMap: { value: noPicture }, pictureStrength: { value: 0 }, pictureLevels: { value: 0 }, pictureM: { value: 1 },
  pictureCorner: { value: new Vector2() },
  pictureWindows: { value: Array.from({ length: PICTURE_LEVELS_MAX }, () => new Vector3(0, 0, 1)) },
};

/** What is switched on, and for which materials: those whose triangles may show their edges, or both sides of a line,
 * have marks of their own; plain ones show none of it. */
const on = { TEXTURED: true, GOING: false, OVERLAID: false, PICTURED: false, EDGES: false };
const materials = [];

function groundMaterial(marks, options) {
  const material = new ShaderMaterial({
    uniforms: { ...shared }, vertexShader: GROUND_VERTEX, fragmentShader: GROUND_FRAGMENT, glslVersion: GLSL3,
    ...options,
  });
  material.userData.marks = marks;
  materials.push(material);
  compile(material);
  return material;
}

/** Lets a material reckon what is switched on, and nothing else. */
function compile(material) {
  const { marks } = material.userData;
  const isPlain = marks.includes("PLAIN"), mayShow = (name) => (name === "EDGES" ? marks.includes(name) : !isPlain);
  const wanted = [...Object.keys(on).filter((name) => on[name] && mayShow(name)),
    ...marks.filter((name) => name !== "EDGES")];
  if (Object.keys(material.defines).join() === wanted.join()) return;
  material.defines = Object.fromEntries(wanted.map((name) => [name, ""]));
  material.needsUpdate = true;
}

/** Switches parts of the shaders on or off. */
function turn(switches) {
  changes += 1;
  Object.assign(on, switches);
  materials.forEach(compile);
}

/** Load modules, whose triangles may show their edges; what is drawn coarsely; decks, which are seen from below too;
 * ribbons on the ground, which must not sink into it. */
export const fine = groundMaterial(["EDGES"], {});
/** The same, where two surfaces share the picture: left of the line and right of it. */
export const sides = [-1, 1].map((side) => {
  const material = groundMaterial(["EDGES", "SPLIT"], {});
  material.uniforms.splitSide = { value: side };
  return material;
});
export const coarse = groundMaterial([], { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
export const walls = groundMaterial([], { side: DoubleSide });
export const cliffs = groundMaterial([], {});
export const apron = groundMaterial([], {});
// The relief ends with the area.
for (const { uniforms } of [cliffs, apron]) {
  uniforms.reliefMap = { value: flat };
  uniforms.smoothM = { value: new Vector2(1e8, 2e8) };
  uniforms.softness = { value: 0 };
}
/** What stands on the ground, lit as it is: buildings and walls, layers of leaves, trees. */
export const blocks = groundMaterial(["PLAIN", "WALLED"], { vertexShader: WALL_VERTEX });
export const leaves = groundMaterial(["PLAIN", "LEAVES"], { vertexShader: LEAVES_VERTEX });
export const trees = groundMaterial(["PLAIN", "TREES"], { vertexShader: TREE_VERTEX });
for (const { uniforms } of [blocks, leaves, trees]) {
  uniforms.smoothM = { value: new Vector2(1e8, 2e8) };
  uniforms.softness = { value: 0 };
}
export const decks = groundMaterial([], { side: DoubleSide });
// No offset by slope: far away on level ground that would be many metres, and shine through crests.
export const ribbons = groundMaterial([], {
  vertexShader: RIBBON_VERTEX,
  side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 0, polygonOffsetUnits: -2,
});

/** Sets what the palette says. */
export function setPalette(area) {
  shared.rockTint.value.setRGB(...numbers(area.palette.rock));
  shared.topTint.value.setRGB(...numbers(area.palette.sky[0]));
}

/** Metres within which every tree of a wood stands for itself, from which on one in four does, and up to which. */
export function setLeaves(all, some, most) {
  shared.leavesM.value.set(all, some, most);
}

export function skyMesh() {
  shared.noiseMap.value = noiseTexture();
  const material = new ShaderMaterial({
    uniforms: shared, vertexShader: SKY_VERTEX, fragmentShader: SKY_FRAGMENT, glslVersion: GLSL3, side: BackSide,
    depthWrite: false,
  });
  const sky = new Mesh(new BoxGeometry(2, 2, 2), material);
  sky.frustumCulled = false;
  // After the ground, so that only what it leaves free is reckoned.
  sky.renderOrder = 1;
  return sky;
}

/** Lets the sun stand at a vector east, north, up. */
export function setSun(area, sun) {
  changes += 1;
  const { sun: strength, sky, haze, glow } = lightOf(sun, numbers(area.palette.haze));
  shared.sunWay.value.set(sun[0], sun[2], -sun[1]);
  [["sunTint", strength], ["skyTint", sky], ["hazeTint", haze], ["glowTint", glow]]
    .forEach(([name, tint]) => shared[name].value.setRGB(...tint));
}

/** Light from afar: texels of light.js, and how far they are apart. */
export function setRelief(area, { wide, high, step, data }) {
  changes += 1;
  shared.reliefMap.value.dispose();
  const texture = new DataTexture(data, wide, high, RGBAFormat);
  [texture.minFilter, texture.magFilter, texture.generateMipmaps] = [LinearMipmapNearestFilter, LinearFilter, true];
  texture.needsUpdate = true;
  const [west, south] = area.sides;
  shared.reliefMap.value = texture;
  // South is z, and the texture's rows go north.
  shared.reliefPlace.value.set(1 / (wide * step), -1 / (high * step), (0.5 - west / step) / wide,
    (0.5 - south / step) / high);
}

/** A picture over the ground: a texture of so many metres each way, its north-west corner at a place; null for none. */
export function setOverlay(texture, west, north, metres) {
  turn({ OVERLAID: Boolean(texture) });
  shared.overMap.value = texture ?? clear;
  shared.overPlace.value.set(west ?? 0, -(north ?? 0), metres ?? 1, texture ? 1 : 0);
}

/** The shadows of blocks: depths as the sun sees them, how a place becomes one of theirs, and how far they reach. */
export function setCasts(casts) {
  changes += 1;
  shared.castMap.value = casts?.map ?? null;
  if (casts) shared.castPlace.value.copy(casts.place);
  if (casts) shared.castReach.value.copy(casts.reach);
  else shared.castReach.value.w = 0;
}

/** Pictures over the ground, in the layers of a texture: metres along the side of each, and of the finest pixel; the
 * corner that places count from. */
export function setPictures(texture, sides, finest, [west, south]) {
  changes += 1;
  const levels = Math.min(sides.length, PICTURE_LEVELS_MAX);
  shared.pictureMap.value = texture;
  shared.pictureLevels.value = levels;
  shared.pictureM.value = finest;
  shared.pictureCorner.value.set(west, south);
  for (let level = 0; level < levels; level++) shared.pictureWindows.value[level].z = sides[level];
}

/** The middle of what the layer of a level shows, east and north of the corner. */
export function setPictureWindow(level, [east, north]) {
  changes += 1;
  if (level < PICTURE_LEVELS_MAX) Object.assign(shared.pictureWindows.value[level], { x: east, y: north });
}

/** How strongly pictures cover the ground, from 0 to 1. */
export function setPictureStrength(strength) {
  turn({ PICTURED: 0 < strength });
  shared.pictureStrength.value = strength;
}

/** What the switches say, and how far load modules are seen. */
export function setLook({ wireframe, facets, texture, going, range }) {
  turn({ EDGES: Boolean(wireframe), TEXTURED: Boolean(texture), GOING: Boolean(going) });
  // A layer of slopes tells those of the triangles.
  shared.softness.value = facets || going ? 0 : SOFTNESS;
  shared.smoothM.value.set(0.35 * range, 0.85 * range);
}

/** Where two surfaces meet, as a part of a picture's width. */
export function setSplit(share) {
  if (shared.split.value.x !== share) changes += 1;
  shared.split.value.x = share;
}

/** How many pixels the next picture is wide. */
export function setWidth(pixels) {
  shared.split.value.y = pixels;
}

/** The time for waves, and the shadow under the tank: east, north and metres; 0 for none. */
export function setFrame(seconds, east, north, metres) {
  shared.seconds.value = seconds % 1000;
  shared.blob.value.set(east, -north, Math.max(metres, 1), 0 < metres ? 1 : 0);
}
