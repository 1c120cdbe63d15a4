// How finely pictures are drawn, and when: at the screen's own pixels where a picture's time allows it; where each
// takes long, moving ones are coarser. In software a full one is drawn once nothing moves, and then none until
// something does.
import { Matrix4 } from "three";

/** How much coarser than the one before a ratio of pixels is, and the finest and the coarsest. */
const STEP = 0.8, FINEST = 3, COARSEST = 0.5;
/** The ratio that moving pictures begin with in software. */
const SOFT = 0.65;
/** Milliseconds that a moving picture should take at most, and below which a finer one is tried. */
const SLOW_MS = 48, FAST_MS = 22;
/** Milliseconds that a picture of what stands still may take. */
const FULL_MS = 2000;
/** Pictures between two changes, and milliseconds without motion before the full one. */
const PATIENCE = 8, STILL_MS = 250;

export class Pace {
  constructor(renderer, isSoft) {
    Object.assign(this, { renderer, isSoft, ratio: 1, since: 0, ms: 0, stillSince: null, isFull: false });
    this.ratio = isSoft ? Math.min(SOFT, this.most) : this.most;
    this.last = new Matrix4();
    this.version = -1;
    renderer.setPixelRatio(this.ratio);
  }

  /** The screen's own ratio of pixels, which changes with the screen and its zoom. */
  get most() {
    return Math.min(devicePixelRatio, FINEST);
  }

  /** Whether a picture is to be drawn now; sets how finely. `version` changes with what is drawn. */
  draws(camera, version, now) {
    const isStill = this.last.equals(camera.matrixWorld) && this.version === version;
    if (!isStill) {
      this.last.copy(camera.matrixWorld);
      [this.version, this.stillSince] = [version, null];
    }
    // Waves move, and hardware has the time.
    if (!isStill || !this.isSoft) {
      this.set(this.ratio);
      this.isFull = this.ratio === this.full;
      return true;
    }
    // From the first picture on that would be the same: the one before may have taken longer than that.
    this.stillSince ??= now;
    if (this.isFull || now - this.stillSince < STILL_MS) return !this.isFull && this.ratio === this.full;
    this.set(this.full);
    return (this.isFull = true);
  }

  /** The ratio of a picture that may take its time. */
  get full() {
    const afforded = this.ratio * Math.sqrt(FULL_MS / Math.max(this.ms, 1));
    return Math.min(this.most, Math.max(afforded, 1));
  }

  /** After the full picture of a window that changed its size, or of a picture that was asked for. */
  again() {
    [this.isFull, this.version] = [false, -1];
  }

  /** Tells how long the last picture took, where one followed the other. */
  took(ms) {
    this.ms += 0.25 * (ms - this.ms);
    if (++this.since < PATIENCE) return;
    const wanted = SLOW_MS < this.ms ? this.ratio * STEP : this.ms < FAST_MS ? this.ratio / STEP : this.ratio;
    const ratio = Math.min(Math.max(wanted, COARSEST), this.most);
    if (ratio !== this.ratio) [this.ratio, this.since] = [ratio, 0];
  }

  set(ratio) {
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
  }
}
