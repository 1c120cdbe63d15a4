// Corners of ribbons: narrower than a pixel, a road would look dashed, so that from afar it is drawn wider.

/** Pixels that half a ribbon is wide at least. */
const HALF = 0.65;
/** How far it is lifted, as a part of its distance and in metres at most, and how many metres nearer to the eye it
 * counts than it is: the ground beside it is not quite where the line is, but what a crest hides stays hidden. */
const LIFT = 1.5e-4, LIFT_M_MAX = 0.2, NEARER_M = 0.3;

export const RIBBON_VERTEX = /* glsl */ `
  in vec4 tint;
  in vec2 aside;
  uniform vec2 split;
  out vec3 place, facing, bary;
  out vec4 own;
  void main() {
    float lift = clamp(-${LIFT} * (modelViewMatrix * vec4(position, 1.0)).z, 0.0, ${LIFT_M_MAX});
    place = position + vec3(0.0, lift, 0.0);
    facing = normal;
    own = tint;
    bary = vec3(1.0);
    // What is nearer to the eye on the way to it is seen in the same place.
    vec4 inView = modelViewMatrix * vec4(place, 1.0);
    inView.xyz *= 1.0 - min(${NEARER_M} / max(length(inView.xyz), 1.0), 0.1);
    vec4 at = projectionMatrix * inView;
    mat4 seen = projectionMatrix * modelViewMatrix;
    // The middle of the ribbon beside the corner, and a place further along it: what is left of that on the map is
    // left of it in the picture.
    vec3 middle = place - vec3(aside.x, 0.0, aside.y);
    vec4 from = seen * vec4(middle, 1.0);
    vec4 to = seen * vec4(middle + 5.0 * normalize(vec3(-aside.y, 0.0, aside.x)), 1.0);
    if (aside != vec2(0.0) && 1.0 < min(at.w, min(from.w, to.w))) {
      vec2 pixels = 0.5 * split.y * vec2(1.0, projectionMatrix[0][0] / projectionMatrix[1][1]);
      vec2 line = normalize((to.xy / to.w - from.xy / from.w) * pixels), across = vec2(-line.y, line.x);
      float wide = dot((at.xy / at.w - from.xy / from.w) * pixels, across);
      at.xy += max(${HALF} - wide, 0.0) * across / pixels * at.w;
    }
    gl_Position = at;
  }
`;
