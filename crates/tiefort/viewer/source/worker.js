// The part that runs beside the page, so that no picture waits for it: reads the relief, and lights it.
import { texels } from "./light.js";
import { answer } from "./server.js";

let relief = null, wanted = null;

/** The relief as the server gives it: what shades are reckoned from, and classes. */
async function read(sideM) {
  const bytes = await (await answer("/api/relief")).arrayBuffer(), [wide, high, steps] = new Uint32Array(bytes, 0, 3);
  const [low, unit] = new Float32Array(bytes, 12, 2), numbers = new Uint16Array(bytes, 20, wide * high);
  const heights = Float32Array.from(numbers, (number) => low + unit * number);
  return { wide, high, heights, step: sideM / steps };
}

function light() {
  if (!relief || !wanted) return;
  const data = texels(relief, wanted);
  postMessage({ wide: relief.wide, high: relief.high, step: relief.step, data }, [data.buffer]);
  wanted = null;
}

export function work() {
  onmessage = async ({ data: { sideM, sun } }) => {
    wanted = sun;
    if (sideM) {
      try {
        relief = await read(sideM);
      } catch (fault) {
        return postMessage({ fault: fault.message });
      }
    }
    light();
  };
}
