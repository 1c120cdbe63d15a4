// What check_viewer.mjs looks at: a track as GPX, and lines of sight over the round earth.

import { until } from "./wait.mjs";

const state = (page) => page.evaluate("window.tiefort.state()");

/** A track that is saved as GPX has places in degrees, where the observer stands. */
export async function tracked(page, { expect, pause }) {
  await page.evaluate(() => {
    const make = URL.createObjectURL;
    URL.createObjectURL = (blob) => make((window.saved = blob));
    document.getElementById("track").value = "gpx";
  });
  await page.keyboard.press("KeyZ");
  await pause(2300);
  await page.keyboard.press("KeyZ");
  await until(page, "window.saved !== undefined", 30_000);
  const { east, north } = await state(page);
  const where = await page.evaluate(async (place) => (await fetch(`/api/where/${place}`)).json(), `${east},${north}`);
  const text = await page.evaluate(() => window.saved.text());
  const points = [...text.matchAll(/<trkpt lat="(.+?)" lon="(.+?)"/g)];
  const [, latitude, longitude] = points.at(-1) ?? [];
  const isThere = Math.abs(latitude - where.latitude) < 1e-4 && Math.abs(longitude - where.longitude) < 1e-4;
  const isGpx = text.startsWith("<?xml") && 1 < points.length;
  expect(isGpx && isThere, `a track of ${points.length} places is saved as GPX`);
}

/** Over the round earth a line of sight is that of the program, and another than over the flat one. */
export async function curved(page, { expect, run, folder, size }) {
  const clearances = [];
  for (const isRound of [false, true]) {
    await page.evaluate((isRound) => (document.getElementById("curved").checked = isRound), isRound);
    await page.keyboard.press("KeyR");
    await page.mouse.click(size.width / 2 - 60, size.height * 0.9);
    await page.mouse.click(size.width / 2 + 160, size.height * 0.85);
    await until(page, "window.tiefort.state().answer?.clearance_m !== undefined", 30_000);
    const { answer: line } = await state(page), end = ([east, north]) => `${east.toFixed(3)},${north.toFixed(3)},2.5`;
    const words = ["sight", folder, "--from", end(line.from), "--to", end(line.to)];
    const said = run(isRound ? [...words, "--curvature"] : words);
    expect(said.includes(`clearance  ${line.clearance_m.toFixed(2)} m`),
      `over the ${isRound ? "round" : "flat"} earth a line clears the ground by ${line.clearance_m.toFixed(3)} m`);
    clearances.push(line.clearance_m);
    await page.keyboard.press("Escape");
  }
  await page.evaluate(() => (document.getElementById("curved").checked = false));
  expect(clearances[0] !== clearances[1], "and the two differ");
}
