// The small map: the whole area, the block that is loaded, the observer.
import { bytes, colorOf, isWater } from "./colors.js";
import { isSea } from "./server.js";

/** Draws on `canvas`; `go(east, north)` is called for clicks. */
export class SmallMap {
  constructor(area, canvas, go) {
    const longer = Math.max(area.rows, area.cols), size = canvas.width;
    this.area = area;
    this.canvas = canvas;
    canvas.width = Math.max(Math.round((size * area.cols) / longer), 40);
    canvas.height = Math.max(Math.round((size * area.rows) / longer), 40);
    this.pixels = canvas.width / (area.cols * area.side_m);
    // Painted when it is first drawn.
    this.ground = this.water = null;
    canvas.addEventListener("click", (event) => {
      const [x, y] = [event.offsetX / this.pixels, event.offsetY / this.pixels];
      go(area.sides[0] + x, area.sides[3] - y);
    });
  }

  /** Paints the area anew: shaded heights, water and holes, or a square for each load module. */
  repaint(colors) {
    const { area } = this, { wide, high, heights, classes } = area.coarse;
    const ground = (this.ground ??= document.createElement("canvas"));
    const byModule = (this.byModule = colors !== "height");
    [ground.width, ground.height] = byModule ? [area.cols, area.rows] : [wide, high];
    const picture = new ImageData(ground.width, ground.height);
    const covers = Array.from({ length: 256 }, (_, ofClass) => colorOf.cover(area, ofClass));
    for (let row = 0; row < ground.height; row++) {
      for (let col = 0; col < ground.width; col++) {
        const at = 4 * ((ground.height - 1 - row) * ground.width + col);
        let color, shade = 1;
        if (byModule) {
          const figures = area.figures(row, col);
          color = colorOf[colors](area, colors === "limits" ? figures.count : figures.rms);
        } else {
          const place = row * wide + col, step = area.side_m / area.coarse_steps;
          // Light from the north-west.
          const beside = Math.min(row, high - 2) * wide + Math.min(col, wide - 2);
          const slope = (heights[beside + 1] - heights[beside + wide]) / step;
          shade = Math.min(Math.max(0.9 + slope, 0.45), 1.25);
          color = covers[classes[place]]
            ?? (isSea(area, [heights[place]]) ? colorOf.sea(area) : colorOf.height(area, heights[place]));
        }
        for (let part = 0; part < 3; part++) picture.data[at + part] = 255 * shade * color[part];
        picture.data[at + 3] = 255;
      }
    }
    ground.getContext("2d").putImageData(picture, 0, 0);
  }

  /** Rivers and streams as wide as they are, but rivers not thinner than two pixels and streams than one: most are
   * narrower than what the ground is painted of, which shows pieces of them. */
  rivers() {
    const { area, pixels } = this, drawn = document.createElement("canvas"), context = drawn.getContext("2d");
    Object.assign(drawn, { width: this.canvas.width, height: this.canvas.height });
    context.lineCap = "round";
    const at = ([east, north]) => [(east - area.sides[0]) * pixels, (area.sides[3] - north) * pixels];
    for (const { class: of, width, ends: [from, to] } of [...area.lines.values()].flat()) {
      if (!isWater(area, of)) continue;
      context.strokeStyle = `rgb(${bytes(colorOf.cover(area, of) ?? colorOf.sea(area)).join()})`;
      context.lineWidth = Math.max(width * pixels, area.classes[of] === "stream" ? 1 : 2);
      context.beginPath();
      context.moveTo(...at(from));
      context.lineTo(...at(to));
      context.stroke();
    }
    return drawn;
  }

  draw(block, tank, range) {
    if (!this.ground) this.repaint("height");
    const { area, canvas, pixels } = this, context = canvas.getContext("2d");
    context.imageSmoothingEnabled = !this.byModule;
    // Heights are those of the middles of its pixels, the outermost on the border of the area.
    const half = this.byModule ? 0 : (pixels * area.side_m) / area.coarse_steps / 2;
    context.drawImage(this.ground, -half, -half, canvas.width + 2 * half, canvas.height + 2 * half);
    if (!this.byModule) context.drawImage((this.water ??= this.rivers()), 0, 0);
    const [x, y] = [(tank.east - area.sides[0]) * pixels, (area.sides[3] - tank.north) * pixels];
    if (block) {
      const [south, west, north, east] = block.map((line) => line * area.side_m * pixels);
      context.lineWidth = 1.5;
      context.strokeStyle = "#ffe14d";
      context.strokeRect(west, canvas.height - north, east - west, north - south);
    }
    context.beginPath();
    context.arc(x, y, range * pixels, 0, 2 * Math.PI);
    context.strokeStyle = "rgba(255, 255, 255, 0.7)";
    context.lineWidth = 1;
    context.stroke();
    context.save();
    context.translate(x, y);
    context.rotate(tank.heading + (tank.flies ? tank.turned : 0));
    context.beginPath();
    for (const [right, down] of [[0, -8], [5, 6], [0, 3], [-5, 6]]) context.lineTo(right, down);
    context.closePath();
    context.fillStyle = "#d0257a";
    context.strokeStyle = "#ffffff";
    context.fill();
    context.stroke();
    context.restore();
  }
}
