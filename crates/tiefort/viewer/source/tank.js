// The observer: a tank that follows the triangles it stands on, or an eye that flies above them.
import { BoxGeometry, CylinderGeometry, Group, Matrix4, Mesh, MeshLambertMaterial, Vector3 } from "three";

const BACK_MPS = 6, GAIN_MPS2 = 6, BRAKE_MPS2 = 14, TURN_RADPS = 0.7;
const CLEARANCE_M = 3, CEILING_M = 12_000;
/** Highest speed in each gear, driving and in flight, metres a second; the gears that are in at first. */
const GEARS = { driving: [4, 10, 18, 25], flying: [20, 80, 200, 500] }, FIRST_GEARS = { driving: 2, flying: 1 };
/** Metres a second of the slow approach before the observer does anything. */
const DRIFT_MPS = 14;
/** Times as fast with the shift key. */
const HURRY = 10;
/** Half of the tracks' length and of the distance between them, metres. */
const HALF_LENGTH = 3, HALF_WIDTH = 1.4;
/** How much higher than its tracks a deck may begin for the tank to drive on it, and how far it goes before it looks
 * again what it stands on: so it stays on a bridge, or under it. */
const STEP_M = 1.5, LOOK_M = 3;
/** How far before and behind its middle the tank meets what stands there, how wide it is there, and between which
 * heights above the ground. */
const NOSE_M = 2, REACH_M = 1.6, LOW_M = 0.3, TALL_M = 3;
/** Metres between stems that it fits through, metres a second for each metre more, through what is lower than trees,
 * and out of what it should not be in. */
const FITS_M = 3.4, BY_ROOM = 3, TREES_M = 5, BUSHES_MPS = 5, OUT_MPS = 1;

export class Tank {
  constructor(terrain, east, north, heading) {
    Object.assign(this, { terrain, east, north, heading, speed: 0, driven: 0, flies: false, height: null });
    this.gears = { ...FIRST_GEARS };
    this.drifts = false;
    // Where the observer looks, beyond where the tank points; and how far behind it he is.
    Object.assign(this, { turned: 0, pitch: -0.12, away: 22, chases: true });
    // What keeps it from driving on, or slows it.
    this.meets = null;
    // The tank's own axes: right, up, backwards.
    this.axes = [new Vector3(1, 0, 0), new Vector3(0, 1, 0), new Vector3(0, 0, 1)];
    this.model = model();
  }

  /** One step of `seconds`; `wish` says forward, right, up from -1 to 1, and whether to hurry. */
  step(seconds, wish) {
    const before = [this.east, this.north];
    if (this.flies) this.fly(seconds, wish);
    else this.drive(seconds, wish);
    const [west, south, east, north] = this.terrain.area.sides, wanted = [this.east, this.north];
    this.east = Math.min(Math.max(this.east, west + 1), east - 1);
    this.north = Math.min(Math.max(this.north, south + 1), north - 1);
    // Nobody drives over the edge of the area.
    if (wanted[0] !== this.east || wanted[1] !== this.north) this.speed = 0;
    this.driven += Math.hypot(this.east - before[0], this.north - before[1]);
    this.settle();
  }

  /** The gear that is in, from 0, and its highest speed. */
  get gear() {
    return this.gears[this.flies ? "flying" : "driving"];
  }

  get topSpeed() {
    return GEARS[this.flies ? "flying" : "driving"][this.gear];
  }

  shift(gear) {
    this.gears[this.flies ? "flying" : "driving"] = Math.min(Math.max(gear, 0), GEARS.driving.length - 1);
  }

  drive(seconds, { forward, right, hurry, brake }) {
    const times = hurry ? HURRY : 1;
    const slow = this.slowedTo(this.found(0));
    const most = Math.min(forward < 0 ? BACK_MPS : Infinity, this.topSpeed) * times;
    const wanted = brake ? 0 : forward * Math.min(most, slow);
    const gain = brake ? BRAKE_MPS2 * Math.max(1, Math.abs(this.speed) / this.topSpeed) : GAIN_MPS2 * times;
    const change = gain * seconds * (forward === 0 && !brake ? 2 : 1);
    this.speed += Math.min(Math.max(wanted - this.speed, -change), change);
    // Stems and leaves brake at once.
    this.speed = Math.min(Math.max(this.speed, -slow), slow);
    this.heading += right * TURN_RADPS * seconds * (this.speed < 0 ? -1 : 1);
    const way = this.speed * seconds, looks = Math.ceil(Math.abs(way) / LOOK_M);
    for (let look = 0; look < looks; look++) {
      if (this.stops(way / looks)) break;
      this.move(this.heading, way / looks);
      this.height = this.terrain.under(this.east, this.north, this.ceiling())?.height ?? this.height;
    }
  }

  /** What stands so many metres ahead. */
  found(ahead) {
    const low = this.height ?? 0;
    return this.terrain.met(this.east + ahead * Math.sin(this.heading), this.north + ahead * Math.cos(this.heading),
      REACH_M, low + LOW_M, low + TALL_M);
  }

  /** How fast it is at most among woods, metres a second. */
  slowedTo({ woods }) {
    const speeds = woods.map(({ height, spacing }) =>
      (height < TREES_M ? BUSHES_MPS : Math.max((spacing - FITS_M) * BY_ROOM, OUT_MPS)));
    const slow = Math.min(...speeds, Infinity);
    if (slow < Infinity) this.meets = `in a ${woods[speeds.indexOf(slow)].kind}`;
    else if (OUT_MPS < Math.abs(this.speed)) this.meets = null;
    return slow;
  }

  /** Whether it stops before it goes so far: at a wall, or at stems that stand too close; not where it is there
   * already, since it has to get out. */
  stops(way) {
    const nose = way < 0 ? -NOSE_M : NOSE_M, isClosed = ({ height, spacing }) => TREES_M <= height && spacing < FITS_M;
    const [next, now] = [this.found(nose + way), this.found(nose)];
    const wood = next.woods.find(isClosed), wall = next.prism;
    const what = wall && !now.prism ? wall : wood && !now.woods.some(isClosed) ? wood.kind : null;
    if (what === null) return false;
    [this.speed, this.meets] = [0, `stopped by a ${what}`];
    return true;
  }

  /** Up to what height a surface may lie that the tank drives on, or that the observer flies over. */
  ceiling() {
    if (this.flies) return this.altitude;
    return this.height === null ? Infinity : this.height + STEP_M;
  }

  fly(seconds, { forward, right, up, hurry }) {
    const most = this.topSpeed * (hurry ? HURRY : 1);
    this.heading += right * TURN_RADPS * seconds;
    this.speed = this.drifts ? DRIFT_MPS : forward * most;
    this.move(this.heading + this.turned, this.speed * seconds);
    this.altitude += 0.5 * up * most * seconds;
  }

  move(direction, metres) {
    this.east += Math.sin(direction) * metres;
    this.north += Math.cos(direction) * metres;
  }

  /** Stands on ground or decks: height, pitch and roll from the triangles under the ends of both tracks. */
  settle() {
    const [sin, cos] = [Math.sin(this.heading), Math.cos(this.heading)];
    const at = (along, aside) => this.terrain.under(this.east + along * sin + aside * cos,
      this.north + along * cos - aside * sin, this.ceiling())?.height;
    const ends = [at(HALF_LENGTH, -HALF_WIDTH), at(HALF_LENGTH, HALF_WIDTH), at(-HALF_LENGTH, -HALF_WIDTH),
      at(-HALF_LENGTH, HALF_WIDTH)];
    // Not loaded yet: it stays as it stood.
    if (ends.some((height) => height === undefined)) return;
    const [left, right, backLeft, backRight] = ends;
    this.height = Math.max((left + backRight) / 2, (right + backLeft) / 2);
    const rise = (left + right - backLeft - backRight) / (4 * HALF_LENGTH);
    const lean = (right + backRight - left - backLeft) / (4 * HALF_WIDTH);
    const ahead = new Vector3(sin, rise, -cos).normalize(), aside = new Vector3(cos, lean, sin).normalize();
    const up = new Vector3().crossVectors(aside, ahead).normalize();
    this.axes = [new Vector3().crossVectors(ahead, up), up, ahead.clone().negate()];
    this.tilt = [Math.asin(ahead.y), Math.asin(aside.y)];
    if (typeof this.above === "number") this.altitude = this.height + this.above;
    this.above = null;
    this.altitude = this.flies ? Math.min(Math.max(this.altitude, this.height + CLEARANCE_M), CEILING_M) : this.height;
  }

  takeOff(flies) {
    [this.flies, this.drifts, this.speed] = [flies, false, 0];
    // What it flew above is far below: it comes down to the ground, not to what is under its height.
    if (!flies) this.height = null;
    this.altitude = (this.height ?? 0) + 60;
    this.settle();
  }

  /** Looks ahead and level again, whatever way it was turned. */
  level() {
    [this.turned, this.pitch] = [0, this.flies ? -0.05 : -0.12];
  }

  /** Goes to a place and stands, or flies as high above the ground as before. */
  goTo(east, north) {
    const above = this.flies && this.height !== null ? this.altitude - this.height : null;
    Object.assign(this, { east, north, speed: 0, height: null, drifts: false, above });
  }

  /** Puts the camera where the observer is. */
  place(camera) {
    if (this.height === null && !this.flies) return;
    const base = new Vector3(this.east, this.height ?? 0, -this.north);
    this.model.visible = !this.flies && this.chases;
    this.model.matrixAutoUpdate = false;
    this.model.matrix = new Matrix4().makeBasis(...this.axes).setPosition(base);
    const look = this.heading + this.turned;
    const level = new Vector3(Math.sin(look), 0, -Math.cos(look));
    const ahead = level.clone().multiplyScalar(Math.cos(this.pitch)).setY(Math.sin(this.pitch));
    camera.up.set(0, 1, 0);
    if (this.flies) {
      camera.position.set(this.east, this.altitude, -this.north);
    } else if (this.chases) {
      camera.position.copy(base).addScaledVector(ahead, -this.away).add(new Vector3(0, 3, 0));
      const ground = this.terrain.under(camera.position.x, -camera.position.z, this.ceiling());
      camera.position.y = Math.max(camera.position.y, (ground?.height ?? this.height) + 1.5);
    } else {
      // From the hatch, which leans as the tank does.
      camera.up.copy(this.axes[1]);
      camera.position.copy(base).addScaledVector(this.axes[1], 2.6);
      const right = new Vector3(Math.cos(look), 0, Math.sin(look));
      ahead.y += Math.sin(this.tilt?.[0] ?? 0) * Math.cos(this.turned) + right.y;
    }
    camera.lookAt(camera.position.clone().add(ahead));
    camera.updateMatrixWorld();
  }
}

/** Boxes and a gun, in metres; forward is -z. */
function model() {
  const paint = [0x4d5a34, 0x2c3128, 0x5b693e].map((color) => new MeshLambertMaterial({ color }));
  const tank = new Group();
  const box = (size, [x, y, z], which) => {
    const mesh = new Mesh(new BoxGeometry(...size), paint[which]);
    mesh.position.set(x, y, z);
    tank.add(mesh);
  };
  box([2.4, 0.9, 6.6], [0, 1.05, 0], 0);
  box([0.6, 0.95, 6.2], [-1.4, 0.48, 0], 1);
  box([0.6, 0.95, 6.2], [1.4, 0.48, 0], 1);
  box([2.2, 0.75, 2.9], [0, 1.85, 0.3], 2);
  box([0.7, 0.25, 0.7], [0.5, 2.3, 0.6], 1);
  const gun = new Mesh(new CylinderGeometry(0.09, 0.11, 4.6), paint[1]);
  gun.rotation.x = Math.PI / 2;
  gun.position.set(0, 1.9, -3.3);
  tank.add(gun);
  return tank;
}
