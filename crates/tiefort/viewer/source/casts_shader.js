// The part of the ground's shader that knows the shadows of blocks (casts.js).

export const CAST = /* glsl */ `
  uniform highp sampler2DShadow castMap;
  uniform mat4 castPlace;
  uniform vec4 castReach;
  /* How much of the sun blocks leave a place: 0 to 1. */
  float castLight(vec3 at, vec3 n) {
    if (castReach.w < 0.5) return 1.0;
    vec2 off = abs(at.xz - castReach.xy) / castReach.z;
    float edge = max(off.x, off.y);
    if (1.0 < edge) return 1.0;
    // A little off the surface, so that it does not shade itself.
    vec3 seen = (castPlace * vec4(at + 0.8 * n, 1.0)).xyz;
    if (any(lessThan(seen.xy, vec2(0.0))) || any(lessThan(vec2(1.0), seen.xy))) return 1.0;
    // Each is a mean of four texels by how near they are, so that edges have no steps.
    vec2 texel = 0.75 / vec2(textureSize(castMap, 0));
    float free = 0.0;
    for (int i = 0; i < 4; i++) {
      vec2 aside = texel * vec2(i < 2 ? -1.0 : 1.0, i % 2 == 0 ? -1.0 : 1.0);
      free += texture(castMap, vec3(seen.xy + aside, seen.z));
    }
    return mix(0.25 * free, 1.0, smoothstep(0.85, 1.0, edge));
  }
`;
