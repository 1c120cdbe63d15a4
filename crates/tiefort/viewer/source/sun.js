// Where the sun stands, and what its light is like.

/** As on maps: from the north-west, so that relief is not seen inside out. */
const ON_MAPS = { bearing: 315, height: 34 };
const radians = (degrees) => (degrees * Math.PI) / 180;

/** The sun as on maps where `hour` is null; else that of an equinox at a latitude: a vector east, north, up. */
export function sunAt(hour, latitude) {
  if (hour === null) return vector(radians(ON_MAPS.bearing), radians(ON_MAPS.height));
  const turn = radians(15 * (hour - 12)), lat = radians(latitude);
  return [-Math.sin(turn), -Math.cos(turn) * Math.sin(lat), Math.cos(turn) * Math.cos(lat)];
}

function vector(bearing, height) {
  return [Math.sin(bearing) * Math.cos(height), Math.cos(bearing) * Math.cos(height), Math.sin(height)];
}

const mix = (a, b, share) => a.map((value, i) => value + share * (b[i] - value));

/** Strength and tint of sunlight, skylight and haze: warm and weak when the sun is low. `haze` is that of day. */
export function lightOf(sun, haze) {
  const day = Math.min(Math.max(sun[2] / 0.45, 0), 1), dusk = Math.min(Math.max((sun[2] + 0.12) / 0.25, 0), 1);
  const strength = sun[2] <= 0 ? 0 : Math.min(1, 0.25 + day);
  return {
    sun: mix([0.95, 0.5, 0.25], [0.84, 0.79, 0.67], day).map((part) => part * strength),
    sky: mix([0.16, 0.17, 0.2], mix([0.42, 0.4, 0.42], [0.51, 0.53, 0.58], day), dusk),
    haze: mix([0.13, 0.14, 0.17], mix(haze.map((part, i) => part * [0.98, 0.84, 0.72][i]), haze, day), dusk),
    glow: mix([1, 0.62, 0.32], [1, 0.97, 0.88], day).map((part) => part * dusk),
  };
}
