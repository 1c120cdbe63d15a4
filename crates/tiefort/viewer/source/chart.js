// A profile as a small chart.

/** Draws heights along a line on a canvas of the page. */
export function drawProfile(canvas, { along_m: along, height_m: heights }) {
  const scale = 2, [wide, high] = [288 * scale, 96 * scale], context = canvas.getContext("2d");
  [canvas.width, canvas.height] = [wide, high];
  const known = heights.filter((height) => height !== null), low = Math.min(...known), top = Math.max(...known);
  const rise = Math.max(top - low, 1), length = Math.max(along.at(-1), 1);
  const at = (i) => [(wide * along[i]) / length, high - 14 - ((high - 34) * (heights[i] - low)) / rise];
  context.beginPath();
  context.moveTo(0, high);
  for (let i = 0; i < along.length; i++) if (heights[i] !== null) context.lineTo(...at(i));
  context.lineTo(wide, high);
  context.closePath();
  context.fillStyle = "#8c8f5f";
  context.fill();
  context.fillStyle = "#f6f5f2";
  context.font = "22px system-ui, sans-serif";
  context.fillText(`${top.toFixed(0)} m`, 2, 20);
  context.fillText(`${low.toFixed(0)} m`, 2, high - 4);
}

/** Length, climb, fall and the steepest part of a profile, in words. */
export function profileInWords({ along_m: along, height_m: heights }) {
  let [climb, fall, steepest] = [0, 0, 0];
  for (let i = 1; i < along.length; i++) {
    const rise = heights[i] - heights[i - 1], run = along[i] - along[i - 1];
    if (heights[i] === null || heights[i - 1] === null || run === 0) continue;
    climb += Math.max(rise, 0);
    fall += Math.max(-rise, 0);
    steepest = Math.max(steepest, Math.abs(rise) / run);
  }
  return `${(along.at(-1) / 1000).toFixed(3)} km; climbs ${climb.toFixed(0)} m, falls ${fall.toFixed(0)} m, `
    + `steepest ${(100 * steepest).toFixed(0)} %`;
}
