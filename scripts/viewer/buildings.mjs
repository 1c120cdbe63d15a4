// What check_viewer.mjs looks at: that the ground is whole from high above in all directions, and buildings.

import { until } from "./wait.mjs";

const state = (page) => page.evaluate("window.tiefort.state()");

/** From high above, all around, where fine ground meets coarse and the area its border, no pixel sees the sky. */
export async function turned(page, { expect, open, own, settled }) {
  const middle = [0, 1].map((axis) => own.origin[axis] + ([own.cols, own.rows][axis] * own.side) / 2);
  let [below, sky, places] = [0, 0, []];
  for (const above of [600, 1500]) {
    for (let heading = 0; heading < 360; heading += 30) {
      const at = `east=${middle[0] + 40}&north=${middle[1] - 60}&heading=${heading}.3&range=1000`;
      if (heading === 0) {
        await open(page, at);
        const { height } = await state(page);
        await open(page, `${at}&height=${height + above}&pitch=-20`);
      }
      const seen = await page.evaluate("window.tiefort.skyBelowHorizon()");
      [below, sky] = [below + seen.below, sky + seen.sky];
      if (0 < seen.sky) places.push([above, heading, ...seen.places[0]]);
      await page.mouse.move(800, 300);
      await page.mouse.down();
      await page.mouse.move(800 - TURN_PIXELS, 300, { steps: 3 });
      await page.mouse.up();
      await settled(page);
    }
  }
  const found = `${sky} of ${below} pixels ${JSON.stringify(places)}`;
  expect(sky === 0, `no hole in the ground from above, all around: ${found}`);
}

/** So many pixels of a drag turn the view by 30 degrees. */
const TURN_PIXELS = 131;

/** Blocks of the sample's houses stand in the picture, cast shadows, are counted, and go with their switch. */
export async function housed(page, { expect, picture, pause, serveJob, settled, open }) {
  const other = await serveJob("houses", `[features]\nsources = ["houses.geojson"]\n`, { "houses.geojson": houses() });
  try {
    const at = `east=505550&north=3875500&heading=35&height=${HEIGHT_M}&pitch=-12&range=1000`;
    await open(page, at, other.address);
    await until(page, "window.tiefort.state().houses.drawn === 4", 60_000);
    await settled(page);
    await pause(700);
    const { houses: counts } = await state(page);
    expect(counts.all === 4 && counts.drawn === 4, `${counts.drawn} of ${counts.all} buildings are drawn`);
    await picture(page, "buildings");
    const shot = () => page.screenshot({ encoding: "base64" });
    const [withThem, off] = [await shot(), "buildings"];
    await page.evaluate((id) => document.getElementById(id).click(), off);
    await pause(1200);
    const without = await shot();
    const share = await page.evaluate(difference, withThem, without);
    expect(0.01 < share && share < 0.6, `they take ${(100 * share).toFixed(1)} % of the picture, with their shadows`);
    const { houses: none } = await state(page);
    expect(none.drawn === 0, "their switch takes them away");
    await pause(900);
    const link = await page.evaluate("location.search");
    expect(/layers=/.test(link) && !/buildings/.test(link), `a link says so: ${link}`);
  } finally {
    other.end();
  }
}

/** Metres over the sample's ground there. */
const HEIGHT_M = 1180;

/** Four blocks 150 m and more ahead. */
function houses() {
  const block = ([east, north], side, height) => ({
    type: "Feature", properties: { building: "yes", height: String(height) },
    geometry: {
      type: "Polygon",
      coordinates: [[[0, 0], [side, 0], [side, side], [0, side], [0, 0]].map(([x, y]) => [east + x, north + y])],
    },
  });
  return JSON.stringify({
    type: "FeatureCollection", crs: { type: "name", properties: { name: "urn:ogc:def:crs:EPSG::32611" } },
    features: [
      block([505650, 3875650], 30, 40), block([505720, 3875620], 25, 15), block([505600, 3875720], 20, 9),
      block([505760, 3875760], 60, 60),
    ],
  });
}

/** Runs in the page: the share of pixels in which two pictures differ. */
async function difference(one, other) {
  const pixels = async (shot) => {
    const image = new Image();
    image.src = `data:image/png;base64,${shot}`;
    await image.decode();
    const canvas = document.createElement("canvas"), context = canvas.getContext("2d");
    [canvas.width, canvas.height] = [image.width, image.height];
    context.drawImage(image, 0, 0);
    return context.getImageData(0, 0, image.width, image.height).data;
  };
  const [a, b] = [await pixels(one), await pixels(other)];
  let count = 0;
  for (let i = 0; i < a.length; i += 4) count += 24 < Math.abs(a[i] - b[i]) + Math.abs(a[i + 1] - b[i + 1]) ? 1 : 0;
  return count / (a.length / 4);
}
