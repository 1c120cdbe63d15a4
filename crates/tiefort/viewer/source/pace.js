// How finely pictures are drawn, and when: where each takes long the moving ones are coarser, and once nothing moves a
// full one is drawn and then none until something does.
import { Matrix4 } from "three";

/** Parts of the screen's pixels along a side, the finest first. */
const RATIOS = [1, 0.8, 0.65, 0.5];
/** Milliseconds that a moving picture should take at most, and below which a finer one is tried. */
const SLOW_MS = 48, FAST_MS = 22;
/** Pictures between two changes, and milliseconds without motion before the full one. */
const PATIENCE = 8, STILL_MS = 250;

export class Pace {
  constructor(renderer, isSoft) {
    Object.assign(this, { renderer, isSoft, place: isSoft ? 2 : 0, since: 0, ms: 0, stillSince: null, isFull: false });
    this.most = isSoft ? 1 : Math.min(devicePixelRatio, 2);
    this.last = new Matrix4();
    this.version = -1;
    renderer.setPixelRatio(this.most * RATIOS[this.place]);
  }

  /** Whether a picture is to be drawn now; sets how finely. `version` changes with what is drawn. */
  draws(camera, version, now) {
    if (!this.isSoft) return true;
    const isStill = this.last.equals(camera.matrixWorld) && this.version === version;
    if (!isStill) {
      this.last.copy(camera.matrixWorld);
      [this.version, this.stillSince] = [version, null];
      this.set(this.most * RATIOS[this.place]);
      this.isFull = this.place === 0;
      return true;
    }
    // From the first picture on that would be the same: the one before may have taken longer than that.
    this.stillSince ??= now;
    if (this.isFull || now - this.stillSince < STILL_MS) return !this.isFull && this.place === 0;
    this.set(this.most);
    return (this.isFull = true);
  }

  /** After the full picture of a window that changed its size, or of a picture that was asked for. */
  again() {
    [this.isFull, this.version] = [false, -1];
  }

  /** Tells how long the last picture took, where one followed the other. */
  took(ms) {
    if (!this.isSoft) return;
    this.ms += 0.25 * (ms - this.ms);
    if (++this.since < PATIENCE) return;
    const step = SLOW_MS < this.ms ? 1 : this.ms < FAST_MS ? -1 : 0;
    const place = Math.min(Math.max(this.place + step, 0), RATIOS.length - 1);
    if (place !== this.place) [this.place, this.since] = [place, 0];
  }

  set(ratio) {
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
  }
}
