// The shaders of ground, water and sky. Colours are those of screens from beginning to end, as in the server's
// pictures, so that ground in full light has the colour that the palette gives it.
import { CAST } from "./casts_shader.js";
import { STEEPEST } from "./light.js";
import { LEAVES, WINDOWS } from "./standing_shaders.js";

/** Haze between the eye and what it sees; the same behind everything, so that ground meets sky without a line. */
const HAZE = /* glsl */ `
  uniform vec3 sunWay, hazeTint, glowTint;
  uniform float hazeM;
  vec3 hazeToward(vec3 way) {
    float near = max(dot(way, sunWay), 0.0);
    near *= near;
    return mix(hazeTint, glowTint, 0.45 * near * near * near);
  }
`;

export const GROUND_VERTEX = /* glsl */ `
  in vec4 tint;
  out vec3 place, facing, bary;
  out vec4 own;
  void main() {
    place = position;
    facing = normal;
    own = tint;
    int corner = gl_VertexID % 3;
    bary = vec3(corner == 0, corner == 1, corner == 2);
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  }
`;

/** Levels of pictures: from pixels of a hand's breadth to the largest area. */
export const PICTURE_LEVELS_MAX = 20;

/** The colour of pictures of the ground, multiplied with how opaque it is: from the finest level that reaches so far
 * and is there, but from none that is finer than a pixel of the screen. */
const PICTURES = /* glsl */ `
  uniform highp sampler2DArray pictureMap;
  uniform float pictureStrength, pictureM;
  uniform int pictureLevels;
  uniform vec2 pictureCorner;
  uniform vec3 pictureWindows[${PICTURE_LEVELS_MAX}];
  /** Metres east and south from pixel to pixel of the screen. */
  vec2 across, along;
  vec4 pictured() {
    vec2 at = vec2(place.x, -place.z) - pictureCorner;
    float wide = max(dot(across, across), dot(along, along)), narrow = min(dot(across, across), dot(along, along));
    // Seen at a slant a pixel is long and narrow: something in between.
    float level = 0.25 * log2(max(wide * narrow, 1e-12)) - log2(pictureM);
    vec4 got = vec4(0.0);
    for (int i = clamp(int(floor(level + 0.5)), 0, pictureLevels - 1); i < pictureLevels; i++) {
      vec3 window = pictureWindows[i];
      vec2 off = abs(at - window.xy) / window.z;
      float share = i + 1 == pictureLevels ? 1.0 : clamp(24.0 * (0.5 - max(off.x, off.y)) - 0.1, 0.0, 1.0);
      if (share == 0.0) continue;
      got += (1.0 - got.a) * share * textureLod(pictureMap, vec3(at / window.z, float(i)), 0.0);
      if (0.99 < got.a) break;
    }
    return got * pictureStrength;
  }
`;

/** What is switched off is not compiled in: drawn in software, both sides of a condition are reckoned for every pixel.
 * `own.a` says what it is: 0 ground, 1/2 made by hands (roads, decks), 1 water. */
export const GROUND_FRAGMENT = /* glsl */ `
  ${HAZE}
  ${CAST}
  uniform sampler2D reliefMap, noiseMap, overMap;
  uniform vec4 reliefPlace, overPlace;
  uniform vec3 sunTint, skyTint, rockTint, edgeTint;
  uniform vec2 smoothM;
  uniform float softness, seconds;
  uniform vec4 blob;
  uniform vec2 split;
  uniform float splitSide;
  in vec3 place, facing, bary;
  in vec4 own;
  out vec4 seen;
  #ifdef PICTURED
  ${PICTURES}
  #endif
  #ifdef WALLED
  ${WINDOWS}
  #endif
  #ifdef LEAVES
  ${LEAVES}
  #endif

  vec3 water(vec3 toward, float away, float lit) {
    vec2 at = place.xz / 38.0;
    vec2 ripple = texture(noiseMap, at + seconds * vec2(0.013, 0.007)).ba
      + texture(noiseMap, 2.7 * at.yx - seconds * vec2(0.011, 0.019)).ba - 1.0;
    vec3 n = normalize(vec3(0.16 * ripple.x, 1.0, 0.16 * ripple.y));
    vec3 back = reflect(-toward, n);
    back.y = abs(back.y);
    float grazing = 1.0 - max(dot(toward, n), 0.0);
    float share = 0.05 + 0.6 * grazing * grazing * grazing * grazing;
    float glint = max(dot(back, sunWay), 0.0);
    glint *= glint; glint *= glint; glint *= glint; glint *= glint; glint *= glint;
    vec3 deep = own.rgb * (0.62 * skyTint + 0.5 * sunTint * lit + 0.16 * ripple.x);
    return mix(deep, hazeToward(back), share) + 0.5 * glint * lit * glowTint;
  }

  vec3 ground(float away, vec3 n, vec3 smoothly, float lit, float open) {
    vec3 base = own.rgb;
    #ifdef TEXTURED
      float patches = 1.2 * (texture(noiseMap, place.zx / 3700.0).r - 0.48), grain = 0.0;
      // Further away it is as good as even.
      if (away < 1500.0) {
        vec2 near = texture(noiseMap, place.xz / 23.0).rg;
        patches += 0.3 * (near.r - 0.48);
        grain = near.g - 0.47;
      }
      if (own.a < 0.25) {
        float steep = smoothstep(0.06, 0.26, 1.0 - mix(n.y, smoothly.y, 0.7) + 0.14 * patches);
        base = mix(base * (1.0 + patches * vec3(0.5, 0.42, 0.3)), rockTint * (1.0 + 0.5 * grain), 0.85 * steep);
        base *= 1.0 + 0.34 * grain;
      } else base *= 1.0 + 0.12 * grain;
    #endif
    #ifdef PICTURED
      if (own.a < 0.25) {
        vec4 picture = pictured();
        base = base * (1.0 - picture.a) + picture.rgb;
      }
    #endif
    #ifdef GOING
      float steep = length(n.xz) / max(n.y, 0.05);
      vec3 fair = mix(vec3(0.25, 0.58, 0.27), vec3(0.95, 0.85, 0.35), clamp(steep / 0.25, 0.0, 1.0));
      vec3 hard = mix(fair, vec3(0.9, 0.5, 0.15), clamp((steep - 0.25) / 0.2, 0.0, 1.0));
      base = mix(base, steep < 0.45 ? hard : vec3(0.72, 0.08, 0.08), 0.85);
    #endif
    float bright = max(dot(n, sunWay), 0.0);
    vec3 soft = skyTint * (0.55 + 0.45 * n.y) * open + 0.06 * sunTint;
    #ifdef PLAIN
      // Ground and walls around throw light on what is upright.
      soft = skyTint * (0.86 + 0.14 * n.y) * mix(open, 1.0, 0.6) + 0.14 * sunTint * max(sunWay.y, 0.0);
    #endif
    #ifdef WALLED
      base = glazed(base);
    #endif
    #ifdef LEAVES
      base = leaved(base, n, away);
    #endif
    #ifdef TREES
      bright = max(0.3 + 0.7 * dot(n, sunWay), 0.0);
    #endif
    return base * (soft + sunTint * bright * lit);
  }

  void main() {
    #ifdef PICTURED
      across = dFdx(place.xz);
      along = dFdy(place.xz);
    #endif
    #ifdef SPLIT
      // Two surfaces side by side: each is drawn on its own side of a line across the picture.
      if (splitSide * (gl_FragCoord.x - split.x * split.y) < 0.0) discard;
    #endif
    vec3 toEye = cameraPosition - place;
    float away = length(toEye);
    vec3 toward = toEye / away;
    vec4 relief = texture(reliefMap, place.xz * reliefPlace.xy + reliefPlace.zw);
    vec2 rise = (relief.rg * 255.0 - 127.5) / 127.5;
    rise *= abs(rise) * ${STEEPEST.toFixed(1)};
    float far = mix(softness, 1.0, smoothstep(smoothM.x, smoothM.y, away));
    vec3 smoothly = normalize(vec3(-rise.x, 1.0, rise.y));
    vec3 n = normalize(mix(facing, smoothly, far));
    vec2 from = place.xz - blob.xy;
    float under = blob.w < 0.5 ? 1.0 : 1.0 - 0.55 * (1.0 - smoothstep(0.4, 1.0, dot(from, from) / (blob.z * blob.z)));
    float lit = smoothstep(0.3, 0.7, relief.b) * under;
    #if !defined(LEAVES) && !defined(TREES)
      lit *= castLight(place, facing);
    #endif
    vec3 color = 0.75 < own.a ? water(toward, away, lit) : ground(away, n, smoothly, lit, relief.a * under);
    #ifdef OVERLAID
      vec4 over = texture(overMap, (place.xz - overPlace.xy) / overPlace.z);
      color = mix(color, over.rgb, over.a);
    #endif
    #ifdef EDGES
      vec3 wide = fwidth(bary);
      vec3 inside = smoothstep(vec3(0.0), 1.2 * wide + 1e-6, bary);
      float thin = clamp(1.0 - 4.0 * max(max(wide.x, wide.y), wide.z), 0.0, 1.0);
      color = mix(color, edgeTint, 0.5 * thin * (1.0 - min(min(inside.x, inside.y), inside.z)));
    #endif
    float clear = exp(-away / hazeM);
    seen = vec4(mix(hazeToward(-toward), color, clear), 1.0);
  }
`;

export const SKY_VERTEX = /* glsl */ `
  out vec3 way;
  void main() {
    way = position;
    vec4 at = projectionMatrix * vec4(mat3(viewMatrix) * position, 1.0);
    gl_Position = at.xyww;
  }
`;

export const SKY_FRAGMENT = /* glsl */ `
  ${HAZE}
  uniform sampler2D noiseMap;
  uniform vec3 topTint, skyTint;
  in vec3 way;
  out vec4 seen;
  void main() {
    vec3 toward = normalize(way);
    float up = max(toward.y, 0.0);
    vec3 color = mix(hazeToward(toward), topTint * skyTint * 1.9, 1.0 - exp(-3.2 * up));
    if (0.02 < up) {
      float cloud = texture(noiseMap, 0.11 * toward.xz / (up + 0.12)).r;
      color = mix(color, hazeTint * 1.05, 0.6 * smoothstep(0.47, 0.72, cloud) * smoothstep(0.02, 0.2, up));
    }
    float disc = smoothstep(0.9993, 0.9997, dot(toward, sunWay));
    seen = vec4(mix(color, glowTint, disc), 1.0);
  }
`;
