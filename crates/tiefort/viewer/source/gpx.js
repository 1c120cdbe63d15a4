// A track as GPX 1.1: places in degrees of WGS 84, heights as the area has them.
import { askDegrees } from "./ask.js";

const MARKS = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" };
const plain = (text) => text.replace(/[&<>"]/g, (mark) => MARKS[mark]);

/** The text of a track: rows of time, east, north and height. */
export async function gpxOf(name, rows) {
  const degrees = await askDegrees(rows.map(([, east, north]) => [Number(east), Number(north)]));
  const points = rows.map(([time, , , height], i) => {
    const [longitude, latitude] = degrees[i].map((angle) => angle.toFixed(8));
    return `      <trkpt lat="${latitude}" lon="${longitude}"><ele>${height}</ele><time>${time}</time></trkpt>`;
  });
  return ['<?xml version="1.0" encoding="UTF-8"?>',
    '<gpx version="1.1" creator="tiefort view" xmlns="http://www.topografix.com/GPX/1/1">',
    `  <trk><name>${plain(name)}</name>`, "    <trkseg>", ...points, "    </trkseg>", "  </trk>", "</gpx>", "",
  ].join("\n");
}
