// Keys, mouse and fingers, turned into what the observer wishes.

const KEYS = {
  KeyW: ["forward", 1], ArrowUp: ["forward", 1], KeyS: ["forward", -1], ArrowDown: ["forward", -1],
  KeyD: ["right", 1], ArrowRight: ["right", 1], KeyA: ["right", -1], ArrowLeft: ["right", -1],
  KeyE: ["up", 1], PageUp: ["up", 1], KeyQ: ["up", -1], PageDown: ["up", -1],
};
const BRAKES = ["Space", "KeyB"];
const LOOK_PITCH = [-1.4, 1.2], AWAY = [8, 400];
/** Pixels a pointer may stray in a click, and that a finger drags for full speed. */
const CLICK_PX = 5, FULL_PX = 70;

/** Keys belong to what is written into, chosen from or pressed. */
const isOwn = (event) => event.target.matches("select, input:not([type=checkbox])")
  || (["Space", "Enter"].includes(event.code) && event.target.matches("summary, button, input, a"));

/** Calls `pick(x, y)` for clicks, `press(event)` for keys that switch something, `touch()` for the first of anything;
 * gives what tells wishes. */
export function controls(canvas, tank, { pick, press, touch }) {
  const held = new Set(), pointers = new Map();
  const clamp = (value, [low, high]) => Math.min(Math.max(value, low), high);
  addEventListener("keydown", (event) => {
    touch();
    if (event.ctrlKey || event.metaKey || event.altKey || isOwn(event)) return;
    if (KEYS[event.code] || BRAKES.includes(event.code)) event.preventDefault();
    else if (!event.repeat) press(event);
    held.add(event.code);
  });
  addEventListener("keyup", (event) => held.delete(event.code));
  addEventListener("blur", () => held.clear());
  canvas.addEventListener("pointerdown", (event) => {
    touch();
    canvas.setPointerCapture(event.pointerId);
    canvas.focus();
    const drives = event.pointerType === "touch" && event.clientX < innerWidth / 2;
    const start = [event.clientX, event.clientY];
    pointers.set(event.pointerId, { drives, start, last: start, strayed: false });
  });
  canvas.addEventListener("pointermove", (event) => {
    const pointer = pointers.get(event.pointerId);
    if (!pointer) return;
    const [x, y] = [event.clientX, event.clientY];
    if (CLICK_PX < Math.hypot(x - pointer.start[0], y - pointer.start[1])) pointer.strayed = true;
    if (pointer.strayed && !pointer.drives) {
      tank.turned -= 0.004 * (x - pointer.last[0]);
      tank.pitch = clamp(tank.pitch + 0.004 * (y - pointer.last[1]), LOOK_PITCH);
    }
    pointer.last = [x, y];
  });
  const end = (event) => {
    const pointer = pointers.get(event.pointerId);
    pointers.delete(event.pointerId);
    if (pointer && !pointer.strayed && event.type === "pointerup") pick(event.clientX, event.clientY);
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    touch();
    // Height above the ground, by its share: so one turn of the wheel means the same near the ground and far above.
    if (tank.flies) {
      const ground = tank.height ?? 0;
      tank.altitude = ground + Math.max(tank.altitude - ground, 4) * Math.exp(0.001 * event.deltaY);
    }
    else tank.away = clamp(tank.away * Math.exp(0.001 * event.deltaY), AWAY);
  }, { passive: false });
  return () => {
    const brake = BRAKES.some((code) => held.has(code));
    const wish = { forward: 0, right: 0, up: 0, brake, hurry: held.has("ShiftLeft") || held.has("ShiftRight") };
    for (const code of held) if (KEYS[code]) wish[KEYS[code][0]] += KEYS[code][1];
    for (const { drives, start, last, strayed } of pointers.values()) {
      if (!drives || !strayed) continue;
      wish.forward -= (last[1] - start[1]) / FULL_PX;
      wish.right += (last[0] - start[0]) / FULL_PX;
    }
    for (const axis of ["forward", "right", "up"]) wish[axis] = clamp(wish[axis], [-1, 1]);
    return wish;
  };
}
