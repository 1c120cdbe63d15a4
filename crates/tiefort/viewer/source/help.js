// The keys, and what they do.
import { at } from "./panel.js";

const KEYS = [
  ["W A S D, arrows", "drive, or fly; Shift ten times as fast"],
  ["E Q, wheel", "up and down in flight; the wheel nears the tank"],
  ["Space, B", "brake"],
  ["1 2 3 4", "gear: how fast at most"],
  ["X", "look level and ahead again"],
  ["F", "fly, or come down to the ground"],
  ["H", "from behind the tank, or from its hatch"],
  ["C", "next way of colouring: height, slope and going, residuals, use of the limit, levels"],
  ["T J U", "triangles' edges; facets; texture"],
  ["I", "pictures of the ground, where the command was given some"],
  ["M G", "load-module lines; the ground it was made from"],
  ["0", "buildings and woods, where the area has some"],
  ["R P V", "line of sight between two clicks; distance and profile; what is seen from here (Esc forgets them)"],
  ["N", "go to coordinates: east north, latitude longitude, UTM such as 11S 530000 3899000, MGRS"],
  ["K Z L", "picture with scale and north; record a track; link to this view"],
  ["click", "what is there: load module, triangle, slope, class"],
  ["Y O", "open or close the panels of layers and of figures"],
  ["touch", "left half drives, right half looks"],
  ["?, Esc", "this list, and away with it"],
];

/** Fills the list; gives what shows or hides it. */
export function helpList(extra = []) {
  const box = at("all");
  box.querySelector("dl").replaceChildren(...[...KEYS, ...extra].flatMap(([keys, words]) => {
    const [term, meaning] = [document.createElement("dt"), document.createElement("dd")];
    term.append(...keys.split(" ").flatMap((key) => {
      const cap = document.createElement("kbd");
      cap.textContent = key;
      return [cap, " "];
    }));
    meaning.textContent = words;
    return [term, meaning];
  }));
  return () => (box.open ? box.close() : box.showModal());
}
