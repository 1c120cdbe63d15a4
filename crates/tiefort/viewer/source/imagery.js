// Pictures of the ground, laid over it: at each level a window of squares around the observer, half as fine as the one
// before and twice as wide, all of them in the layers of one texture. A layer goes on at its other side: a square lies
// at its row and column modulo those of the window, so that one step of the observer changes one row or column of it.
import { Box2, DataArrayTexture, DataTexture, LinearFilter, RepeatWrapping, RGBAFormat, Vector2, Vector3 } from "three";
import * as looks from "./materials.js";
import { at, note } from "./panel.js";
import { answer } from "./server.js";

/** Squares along the side of a window: more are finer far away, and take more memory. */
const WINDOW = 6;
/** Squares asked for at a time, and taken over in one picture. */
const ASKED_MAX = 4, TAKEN_MAX = 2;
/** The answer where no picture lies. */
const NO_PICTURE = 204;
/** How long after squares could not be read they are asked for again. */
const AGAIN_MS = 3000;

export class Imagery {
  constructor(area, renderer) {
    Object.assign(this, { area, renderer, levels: [], wanted: [], came: [], asked: 0, drawn: 0, fault: null });
    this.strength = 1;
    this.isShown = true;
  }

  /** Asks whether there are pictures; the switches appear with them. */
  async begin() {
    const about = await (await answer("/api/imagery")).json();
    if (about.levels === 0) return;
    const { side, pixel_m: finest, levels } = about;
    this.side = side;
    this.texture = new DataArrayTexture(null, WINDOW * side, WINDOW * side, levels);
    Object.assign(this.texture, { format: RGBAFormat, minFilter: LinearFilter, magFilter: LinearFilter });
    this.texture.wrapS = this.texture.wrapT = RepeatWrapping;
    // There is nothing to take over yet, only room.
    this.texture.source.dataReady = false;
    this.texture.needsUpdate = true;
    this.empty = new Uint8Array(4 * side * side);
    this.levels = Array.from({ length: levels }, (_, level) => ({
      pixel: finest * 2 ** level, reach: finest * 2 ** level * side, first: null,
      slots: Array.from({ length: WINDOW * WINDOW }, () => null),
    }));
    looks.setPictures(this.texture, this.levels.map(({ reach }) => WINDOW * reach), finest,
      [this.area.sides[0], this.area.sides[1]]);
    at("pictures").hidden = false;
    at("pictures").title = about.names.join(", ");
    this.show(this.isShown, this.strength);
  }

  /** Shows the pictures, so strongly, or not. */
  show(isShown, strength) {
    Object.assign(this, { isShown, strength });
    looks.setPictureStrength(isShown && 0 < this.levels.length ? strength : 0);
  }

  /** Whether all squares around the observer are there. */
  get isWhole() {
    return this.asked === 0 && this.wanted.length === 0 && this.came.length === 0;
  }

  /** Follows the observer: asks for squares that came near, and takes over those that have come. */
  follow(east, north) {
    if (!this.isShown || this.strength === 0 || this.levels.length === 0) return;
    const [west, south] = this.area.sides;
    let isMoved = false;
    this.levels.forEach((level, index) => {
      const first = [north - south, east - west].map((place) => Math.round(place / level.reach) - WINDOW / 2);
      if (String(first) === String(level.first)) return;
      level.first = first;
      this.vacate(level, index);
      isMoved = true;
    });
    if (isMoved) this.renew(east - west, north - south);
    for (let taken = 0; taken < TAKEN_MAX && 0 < this.came.length; taken++) this.take(this.came.shift());
    while (this.asked < ASKED_MAX && 0 < this.wanted.length) this.ask(this.wanted.shift());
  }

  /** Empties the places of squares that are out of the window of a level. */
  vacate(level, index) {
    const [row, col] = level.first;
    for (let slot = 0; slot < WINDOW * WINDOW; slot++) {
      const old = level.slots[slot], own = this.squareIn(slot, row, col);
      if (old?.key === own.key) continue;
      if (old?.isFull) this.put(index, slot, this.empty);
      level.slots[slot] = { ...own, isFull: false, isAsked: false };
    }
    looks.setPictureWindow(index, [(col + WINDOW / 2) * level.reach, (row + WINDOW / 2) * level.reach]);
  }

  /** The square of a window beginning at a row and column that has a place in its layer. */
  squareIn(slot, row, col) {
    const modulo = (place) => ((place % WINDOW) + WINDOW) % WINDOW;
    const own = [row + modulo(Math.floor(slot / WINDOW) - row), col + modulo((slot % WINDOW) - col)];
    return { row: own[0], col: own[1], key: String(own) };
  }

  /** Lists what is missing: the coarsest first, and nearest among equals. */
  renew(east, north) {
    const [west, south, far, top] = this.area.sides;
    this.wanted = [];
    for (let index = this.levels.length - 1; 0 <= index; index--) {
      const { slots, reach } = this.levels[index];
      const isInside = ({ row, col }) => 0 <= row && 0 <= col && row * reach < top - south && col * reach < far - west;
      const away = ({ row, col }) => Math.hypot((col + 0.5) * reach - east, (row + 0.5) * reach - north);
      const missing = slots.map((square, slot) => ({ index, slot, square }))
        .filter(({ square }) => !square.isAsked && isInside(square));
      this.wanted.push(...missing.sort((a, b) => away(a.square) - away(b.square)));
    }
  }

  async ask({ index, slot, square }) {
    this.asked += 1;
    square.isAsked = true;
    try {
      const response = await answer(`/api/imagery/${index}/${square.row}/${square.col}`);
      if (response.status !== NO_PICTURE) {
        this.came.push({ index, slot, square, data: new Uint8Array(await response.arrayBuffer()) });
      }
      if (this.fault) note("");
      this.fault = null;
    } catch (fault) {
      this.fault = fault.message;
      note(`The imagery could not be read: ${fault.message}`);
      setTimeout(() => {
        square.isAsked = false;
        this.levels[index].first = null;
      }, AGAIN_MS);
    }
    this.asked -= 1;
  }

  /** Takes over a square that is still wanted. */
  take({ index, slot, square, data }) {
    if (this.levels[index].slots[slot] !== square) return;
    square.isFull = true;
    this.drawn += 1;
    this.put(index, slot, data);
  }

  put(index, slot, data) {
    const { side } = this, source = new DataTexture(data, side, side, RGBAFormat);
    const place = new Vector3((slot % WINDOW) * side, Math.floor(slot / WINDOW) * side, index);
    this.renderer.copyTextureToTexture(source, this.texture, new Box2(new Vector2(), new Vector2(side, side)), place);
    looks.changed();
  }
}
