// Corners of what stands on the ground: walls with their windows, canopies, trees.

export const WALL_VERTEX = /* glsl */ `
  in vec4 tint;
  in vec2 bay;
  out vec3 place, facing, bary;
  out vec4 own;
  out vec2 window;
  void main() {
    place = position;
    facing = normal;
    own = tint;
    bary = vec3(1.0);
    window = bay;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  }
`;

/** Windows: `window` is the number of bays along a wall, and metres below the eaves; below 0 there are none. */
export const WINDOWS = /* glsl */ `
  in vec2 window;
  vec3 glazed(vec3 wall) {
    vec2 bays = vec2(window.x, window.y / 3.0), wide = fwidth(bays) + 1e-4, at = fract(bays);
    if (window.y < 0.0) return wall;
    vec2 low = vec2(0.29, 0.3), high = vec2(0.71, 0.78);
    vec2 pane = smoothstep(low - wide, low + wide, at) * (1.0 - smoothstep(high - wide, high + wide, at));
    // Of windows that are smaller than a pixel only their share is left.
    float share = mix(pane.x * pane.y, 0.2, smoothstep(0.3, 0.8, max(wide.x, wide.y)));
    return mix(wall, vec3(0.26, 0.3, 0.34), 0.8 * share);
  }
`;

/** `lift` is how much higher a corner lies far away, and whether trees stand here nearby. */
export const LEAVES_VERTEX = /* glsl */ `
  in vec4 tint;
  in vec2 lift;
  uniform vec3 leavesM;
  out vec3 place, facing, bary;
  out vec4 own;
  out float trees;
  void main() {
    float away = distance(position, cameraPosition);
    place = position + vec3(0.0, lift.x * smoothstep(0.6 * leavesM.z, leavesM.z, away), 0.0);
    facing = normal;
    own = tint;
    bary = vec3(1.0);
    trees = lift.y;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(place, 1.0);
  }
`;

export const TREE_VERTEX = /* glsl */ `
  in vec3 pointed;
  in vec4 tint, stand, shape;
  uniform vec3 leavesM;
  out vec3 place, facing, bary;
  out vec4 own;
  void main() {
    vec3 form = mix(position, pointed, shape.z);
    float away = distance(stand.xyz, cameraPosition);
    // Beyond where each is drawn, one in four stands for the others; those grow away.
    float gone = smoothstep(leavesM.x, leavesM.y, away), wide = shape.x * mix(1.0, 1.5, gone);
    if (shape.w != 0.0) wide *= 1.0 - gone;
    bool isTrunk = form.y < 0.1 || length(form.xz) < 0.08 && form.y < 0.6;
    float size = isTrunk ? min(wide, 3.5) : wide;
    float turn = 6.28 * shape.y;
    vec2 across = mat2(cos(turn), sin(turn), -sin(turn), cos(turn)) * form.xz;
    float tall = stand.w * (shape.w != 0.0 ? 1.0 - 0.6 * gone : 1.0);
    place = stand.xyz + vec3(size * across.x, tall * form.y, size * across.y);
    vec2 outward = normalize(across + 1e-4);
    facing = normalize(vec3(outward.x, mix(-0.1, 1.1, form.y), outward.y));
    vec3 dark = shape.z < 0.5 ? vec3(1.0) : vec3(0.72, 0.82, 0.82);
    own = vec4(tint.rgb * shape.y * dark * (isTrunk ? 0.8 : 0.55 + 0.55 * form.y), tint.a);
    bary = vec3(1.0);
    gl_Position = projectionMatrix * modelViewMatrix * vec4(place, 1.0);
  }
`;

/** Leaves from outside: crowns beside each other. Where trees are drawn, the layer is left out. */
export const LEAVES = /* glsl */ `
  in float trees;
  uniform vec3 leavesM;
  vec3 leaved(vec3 leaf, vec3 n, float away) {
    vec2 at = 0.4 < abs(n.y) ? place.xz : vec2(dot(place.xz, normalize(vec2(n.z, -n.x))), 1.6 * place.y);
    vec2 mean = vec2(0.48, 0.47);
    vec2 crowns = texture(noiseMap, at / 41.0).rg - mean, grain = texture(noiseMap, at.yx / 13.0).rg - mean;
    if (0.5 < trees && away < mix(leavesM.x, leavesM.y, clamp(0.5 + 3.0 * grain.y, 0.0, 1.0))) discard;
    return leaf * (1.0 + 1.1 * crowns.y + 0.7 * grain.x + 0.5 * crowns.x);
  }
`;
