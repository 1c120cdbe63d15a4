// Noise that repeats, as one small texture with mipmaps: it stands on the ground, so it neither swims nor flickers.
import { DataTexture, LinearFilter, LinearMipmapNearestFilter, RepeatWrapping, RGBAFormat } from "three";

const SIZE = 256;

/** Numbers from 0 to 1, always the same ones. */
function random(seed) {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 4294967296;
  };
}

/** A layer of octaves, the coarsest of `cells` a side, each half as strong as the one before. */
function octaves(cells, count, seed) {
  const out = new Float32Array(SIZE * SIZE);
  for (let octave = 0, share = 0.5; octave < count; octave++, share /= 2) {
    const side = cells << octave, next = random(seed + octave);
    const lattice = Float32Array.from({ length: side * side }, next);
    const smooth = (at) => at * at * (3 - 2 * at);
    for (let y = 0, i = 0; y < SIZE; y++) {
      const v = (y * side) / SIZE, row = Math.floor(v), up = smooth(v - row);
      const [low, high] = [(row % side) * side, ((row + 1) % side) * side];
      for (let x = 0; x < SIZE; x++, i++) {
        const u = (x * side) / SIZE, col = Math.floor(u), right = smooth(u - col), east = (col + 1) % side;
        const below = lattice[low + col] + right * (lattice[low + east] - lattice[low + col]);
        const above = lattice[high + col] + right * (lattice[high + east] - lattice[high + col]);
        out[i] += share * (below + up * (above - below));
      }
    }
  }
  return out;
}

/** Red: patches; green: grain; blue and alpha: slopes of ripples across and up. */
export function noiseTexture() {
  const patches = octaves(4, 5, 1), grain = octaves(16, 4, 7), ripples = octaves(8, 4, 13);
  const data = new Uint8Array(4 * SIZE * SIZE), byte = (value) => Math.min(Math.max(Math.round(255 * value), 0), 255);
  for (let i = 0; i < SIZE * SIZE; i++) {
    const [x, y] = [i % SIZE, Math.floor(i / SIZE)];
    const east = ripples[y * SIZE + ((x + 1) % SIZE)], north = ripples[((y + 1) % SIZE) * SIZE + x];
    data.set([byte(patches[i]), byte(grain[i]), byte(0.5 + 6 * (east - ripples[i])),
      byte(0.5 + 6 * (north - ripples[i]))], 4 * i);
  }
  const texture = new DataTexture(data, SIZE, SIZE, RGBAFormat);
  texture.wrapS = texture.wrapT = RepeatWrapping;
  [texture.minFilter, texture.magFilter, texture.generateMipmaps] = [LinearMipmapNearestFilter, LinearFilter, true];
  texture.needsUpdate = true;
  return texture;
}
