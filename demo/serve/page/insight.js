// What can be seen inside: times of the stages, the phase of the stride, the attention map.

import { element, find } from "./dom.js";

const STAGES = { controller: "controller", features: "features", stylizer: "stylizer", foot_lock: "foot lock", frame: "frame" };
const FRAME_MS = 16.7;

export class Insight {
  constructor() {
    this.lamps = find("lamps").querySelectorAll("i");
  }

  setState(state) {
    for (const name of ["times", "phase", "attention"]) find(name).hidden = !state.seen.includes(name);
  }

  setTimes(times) {
    const row = ([name, label]) => {
      const bar = element("i", { style: `width:${Math.min(100, (times[name] / FRAME_MS) * 100)}%` });
      return element("div", {}, element("span", {}, label), bar, element("b", {}, times[name].toFixed(1)));
    };
    find("stages").replaceChildren(...Object.entries(STAGES).filter(([name]) => name in times).map(row));
  }

  // Of a frame: a hand that goes round once a stride, and a lamp for each joint that is on the ground.
  setPhase({ phase, contacts }) {
    find("hand").setAttribute("transform", `rotate(${(phase / 65535) * 360})`);
    this.lamps.forEach((lamp, i) => (lamp.style.opacity = 0.12 + (0.88 * contacts[i]) / 255));
  }

  // Bytes of a map, row by row, in the style's colour.
  setAttention({ part, styles, columns, map, why }, colours) {
    const words = why ?? `across: a stride of ${styles.join(" and ") || "the neutral motion"}`;
    find("attention").querySelector("h3").textContent = `attention of the ${part.replace("_", " ")}`;
    find("attention").querySelector("p").textContent = words;
    find("attention").title = "down: the last half second; bright: used most";
    const picture = find("map");
    picture.hidden = !map;
    if (!map) return;
    const [red, green, blue] = (colours[styles[0]] ?? "#a9bccf").match(/\w\w/g).map((pair) => parseInt(pair, 16));
    Object.assign(picture, { width: columns, height: map.length / 2 / columns });
    const pixels = new ImageData(picture.width, picture.height);
    for (let i = 0; i < map.length / 2; i++) {
      const share = parseInt(map.substr(2 * i, 2), 16) / 255;
      pixels.data.set([red * share, green * share, blue * share, 255], 4 * i);
    }
    picture.getContext("2d").putImageData(pixels, 0, 0);
  }
}
