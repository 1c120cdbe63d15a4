// The picture as a file, with an arrow to the north and a scale, and a drive as a track.
import { gpxOf } from "./gpx.js";
import { setWidth } from "./materials.js";
import { at } from "./panel.js";
import { hitAt } from "./pick.js";

function save(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** The largest of 1, 2, 5, 10, … that is not above a length. */
const round = (length) => {
  const power = 10 ** Math.floor(Math.log10(length));
  return power * [5, 2, 1].find((times) => times * power <= length);
};

/** Draws the scene and what belongs on a picture of it; gives a canvas. */
export function pictureOf(view) {
  const { renderer, scene, camera, tank, area, pace } = view, source = renderer.domElement;
  pace.again();
  pace.set(pace.most);
  setWidth(renderer.domElement.width);
  renderer.render(scene, camera);
  const canvas = document.createElement("canvas"), context = canvas.getContext("2d");
  [canvas.width, canvas.height] = [source.width, source.height];
  context.drawImage(source, 0, 0);
  const unit = canvas.width / innerWidth, [right, bottom] = [canvas.width - 24 * unit, canvas.height - 22 * unit];
  context.font = `${14 * unit}px system-ui, sans-serif`;
  [context.strokeStyle, context.fillStyle, context.lineWidth] = ["#ffffff", "#ffffff", 2 * unit];
  [context.shadowColor, context.shadowBlur, context.textAlign] = ["#000000", 4 * unit, "right"];
  const hit = hitAt(view, innerWidth / 2, 0.7 * innerHeight);
  if (hit) {
    // Across the picture at the distance of the ground in its lower middle.
    const metres = (2 * hit.distance * Math.tan((camera.fov * Math.PI) / 360)) / canvas.height;
    const length = round(160 * unit * metres), wide = length / metres;
    context.strokeRect(right - wide, bottom, wide, 1);
    context.fillText(`${length < 1000 ? `${length} m` : `${length / 1000} km`} at ${hit.distance.toFixed(0)} m`,
      right, bottom - 8 * unit);
  }
  context.textAlign = "left";
  const [east, north] = area.inSystem(tank.east, tank.north);
  context.fillText(`${area.name}: ${east.toFixed(0)}, ${north.toFixed(0)} (${area.crs})`, 24 * unit, bottom);
  context.translate(right - 20 * unit, 60 * unit);
  context.rotate(-(tank.heading + tank.turned));
  context.beginPath();
  for (const [x, y] of [[0, -26], [9, 12], [0, 5], [-9, 12]]) context.lineTo(x * unit, y * unit);
  context.closePath();
  context.fill();
  context.fillText("N", -5 * unit, -30 * unit);
  return canvas;
}

/** Saves the picture. */
export function savePicture(view) {
  pictureOf(view).toBlob((blob) => save(blob, `${view.area.name}.png`));
}

/** Records where the observer is, once a second, until it is pressed again; then saves it as the page says. */
export function recorder(view) {
  let rows = null, timer = 0;
  const note = () => {
    const { tank, area } = view, [east, north] = area.inSystem(tank.east, tank.north);
    const height = tank.flies ? tank.altitude : tank.height;
    if (height === null) return;
    const heading = (((tank.heading * 180) / Math.PI) % 360 + 360) % 360;
    rows.push([new Date().toISOString(), east.toFixed(2), north.toFixed(2), height.toFixed(2), tank.speed.toFixed(2),
      heading.toFixed(1)]);
  };
  return async () => {
    at("record").setAttribute("aria-pressed", rows === null);
    if (rows === null) {
      rows = [];
      timer = setInterval(note, 1000);
      note();
      return null;
    }
    clearInterval(timer);
    const track = rows, { name } = view.area;
    rows = null;
    if (at("track").value === "gpx") {
      save(new Blob([await gpxOf(name, track)], { type: "application/gpx+xml" }), `${name}-track.gpx`);
    } else {
      const head = "time,east_m,north_m,height_m,speed_mps,heading_degrees";
      const text = [head, ...track.map((row) => row.join(","))].join("\n") + "\n";
      save(new Blob([text], { type: "text/csv" }), `${name}-track.csv`);
    }
    return track.length;
  };
}
