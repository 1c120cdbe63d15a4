// What check_viewer.mjs looks at besides driving: the beginning, panels, a phone, the tools, a link opened again.

import { until } from "./wait.mjs";

const KEYS_OF_COLORS = ["height", "going", "residuals", "limits", "levels"];
const near = (a, b, most) => Math.abs(a - b) <= most;
const text = (page, id) => page.$eval(`#${id}`, (box) => box.textContent);
const state = (page) => page.evaluate("window.tiefort.state()");

/** Begins in flight and nears what it sees, until the first key; the help goes then. */
export async function begun(page, { address, expect, picture, pause }) {
  const since = Date.now();
  await page.goto(address, { timeout: 120_000 });
  await until(page, "window.tiefort !== undefined && 0 < window.tiefort.state().count");
  console.log(`     first picture after ${Date.now() - since} ms`);
  await until(page, "window.tiefort.state().height !== null && window.tiefort.state().lit");
  const first = await state(page);
  await pause(1500);
  const second = await state(page), gone = Math.hypot(second.east - first.east, second.north - first.north);
  expect(first.flies && first.drifts && 1 < gone && gone < 100, `begins in flight and nears, ${gone.toFixed(1)} m`);
  expect(first.height + 30 < first.altitude, `${(first.altitude - first.height).toFixed(0)} m above the ground`);
  await picture(page, "begin");
  await page.keyboard.press("KeyX");
  await pause(900);
  const help = await page.$eval("#keys", (box) => getComputedStyle(box).opacity);
  expect(help === "0" && !(await state(page)).drifts, "the first key ends the approach and the help");
}

/** Share of the window that panels cover. */
const covered = (page) => page.evaluate(() => {
  const boxes = [...document.querySelectorAll(".box")].map((box) => box.getBoundingClientRect());
  let hit = 0;
  for (let y = 0; y < 50; y++) {
    for (let x = 0; x < 50; x++) {
      const [left, top] = [((x + 0.5) * innerWidth) / 50, ((y + 0.5) * innerHeight) / 50];
      hit += boxes.some((box) => box.left <= left && left < box.right && box.top <= top && top < box.bottom) ? 1 : 0;
    }
  }
  return hit / 2500;
});

/** Panels leave the ground free, on a phone too; the keys are listed on `?`. */
export async function framed(page, { expect, picture, pause, size }) {
  const closed = await covered(page);
  await page.evaluate(() => document.querySelectorAll("details").forEach((box) => (box.open = true)));
  await pause(400);
  const open = await covered(page);
  const shares = [closed, open].map((share) => `${(100 * share).toFixed(0)} %`);
  expect(closed < 0.13 && open <= 0.45, `panels cover ${shares[0]}, all open ${shares[1]}`);
  await picture(page, "panels");
  await page.evaluate(() => document.querySelectorAll("details").forEach((box) => (box.open = false)));
  await page.setViewport({ width: 390, height: 800, hasTouch: true, isMobile: true });
  await pause(1200);
  const phone = await covered(page);
  expect(phone < 1 / 3, `on a phone panels cover ${(100 * phone).toFixed(0)} %`);
  await picture(page, "phone");
  await page.setViewport({ ...size, hasTouch: true });
  // A page that is turned into a phone's, and back, begins again.
  await until(page, "window.tiefort?.state().lit", 60_000);
  await page.keyboard.press("?");
  await pause(300);
  expect(await page.$eval("#all", (box) => box.open && 10 < box.querySelectorAll("dt").length), "? lists the keys");
  await page.keyboard.press("Escape");
  await pause(400);
}

/** Every way of colouring by its key. */
export async function colored(page, { expect, picture, pause }) {
  const seen = [];
  for (let i = 0; i < KEYS_OF_COLORS.length; i++) {
    seen.push(await page.$eval("#colors", (list) => list.value));
    if (["going", "levels"].includes(seen.at(-1))) await picture(page, `colors-${seen.at(-1)}`);
    await page.keyboard.press("KeyC");
    await pause(700);
  }
  expect(KEYS_OF_COLORS.every((colors) => seen.includes(colors)), `C goes through ${seen.join(", ")}`);
}

/** Line of sight, viewshed, profile and coordinates, held against the program's own answers. */
export async function asked(page, { expect, picture, pause, run, folder, size }) {
  await page.keyboard.press("KeyR");
  await page.mouse.click(size.width / 2 - 60, size.height * 0.9);
  await page.mouse.click(size.width / 2 + 160, size.height * 0.72);
  await until(page, "window.tiefort.state().answer !== null", 30_000);
  const { answer: line } = await state(page);
  const end = ([east, north]) => `${east.toFixed(3)},${north.toFixed(3)},2.5`;
  const said = run(["sight", folder, "--from", end(line.from), "--to", end(line.to)]);
  const isSame = said.startsWith(line.visible ? "visible" : "hidden")
    && said.includes(`clearance  ${line.clearance_m.toFixed(2)} m`);
  expect(isSame, `a line of sight is that of the program: ${said.split("\n")[0]}`);
  await picture(page, "sight");
  await page.keyboard.press("Escape");
  await page.keyboard.press("KeyP");
  await page.mouse.click(size.width / 2 - 60, size.height * 0.9);
  await page.mouse.click(size.width / 2 + 160, size.height * 0.72);
  await until(page, "window.tiefort.state().answer?.along_m !== undefined", 30_000);
  expect(/km; climbs \d+ m/.test(await text(page, "answer")), `a profile tells: ${await text(page, "answer")}`);
  await picture(page, "profile");
  await page.keyboard.press("Escape");
  const place = await state(page);
  await page.keyboard.press("KeyV");
  await until(page, "window.tiefort.state().answer?.seen !== undefined", 30_000);
  const { answer: seen } = await state(page);
  expect(0 < seen.seen && seen.seen < seen.places, `a viewshed of ${seen.seen} in ${seen.places} places`);
  await pause(700);
  await picture(page, "viewshed");
  await page.keyboard.press("Escape");
  await page.keyboard.press("KeyN");
  await page.keyboard.type(`11S ${(place.east + 200).toFixed(0)} ${place.north.toFixed(0)}`);
  await page.keyboard.press("Enter");
  await pause(1500);
  const there = await state(page);
  expect(near(there.east, place.east + 200, 1) && near(there.north, place.north, 1), "coordinates of UTM are found");
}

/** A link opens the same place and view. */
export async function linked(page, { expect, address, open }) {
  await page.keyboard.press("KeyL");
  const before = await state(page), link = await page.evaluate("location.search");
  await page.goto("about:blank");
  await open(page, link.slice(1));
  const after = await state(page);
  const isThere = near(before.east, after.east, 0.2) && near(before.north, after.north, 0.2)
    && near(before.turned, after.turned, 0.01) && near(before.pitch, after.pitch, 0.01)
    && before.flies === after.flies && (!before.flies || near(before.altitude, after.altitude, 0.2));
  expect(isThere, `a link opens the same view of ${address}: ${link}`);
}

/** Milliseconds of a picture in the middle and at most, on a machine that does nothing else. */
const MEDIAN_MS_MAX = 60, FRAME_MS_MAX = 150;

/** How long pictures take while driving at full speed, at 1280 x 800; held where the machine is idle. And that what is
 * left behind is let go. */
export async function paced(page, { expect, open, pause, size, start, isIdle }) {
  await page.setViewport({ width: 1280, height: 800, hasTouch: true });
  await open(page, start);
  await page.keyboard.press("Digit4");
  await page.keyboard.down("ShiftLeft");
  await page.keyboard.down("KeyW");
  await pause(2500);
  const { count: before, textures: held } = await state(page);
  await pause(8000);
  const { count, frames, driven } = await state(page);
  await page.keyboard.up("KeyW");
  await page.keyboard.up("ShiftLeft");
  const taken = frames.slice(Math.max(frames.length - (count - before), 0)).sort((a, b) => a - b);
  const median = taken[Math.floor(taken.length / 2)], most = taken.at(-1);
  const told = `pictures of ${median.toFixed(0)} ms in the middle, ${most.toFixed(0)} ms at most, `
    + `${(driven / 1000).toFixed(1)} km`;
  if (isIdle) expect(median <= MEDIAN_MS_MAX && most <= FRAME_MS_MAX, told);
  else console.log(`     ${told}`);
  const { geometries, inScene, textures } = await state(page);
  expect(geometries <= inScene && textures <= held,
    `after it ${geometries} geometries are held, ${inScene} of the scene, and ${textures} textures of ${held}`);
  await page.setViewport({ ...size, hasTouch: true });
}
