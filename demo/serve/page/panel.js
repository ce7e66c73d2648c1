// The panels: the body to pick a part from, styles, strength, presets, what is said and how fast it goes.

import { element, find } from "./dom.js";

const readable = (part) => (part === "all" ? "whole body" : part.replace("_", " "));
const percent = (share) => `${Math.round(share * 100)}%`;

export class Panel {
  constructor(world, act) {
    Object.assign(this, { world, act });
    this.styles = [];
    this.colours = {};
    this.state = null;
    for (const [name, colour] of Object.entries(world.colours.panel))
      document.documentElement.style.setProperty(`--${name}`, colour);
    this.own = css(world.colours.scene.own_style);
    this.buildDiagram();
    this.buildParts();
    for (const button of document.querySelectorAll("[data-do]"))
      button.addEventListener("click", () => act(button.dataset.do));
    find("strength").max = 100 * world.max_strength;
    find("strength").addEventListener("input", (event) => act(`strength:${event.target.value / event.target.max}`));
    find("share").addEventListener("input", (event) => act(`share:${event.target.value / event.target.max}`));
    find("search").addEventListener("input", () => this.showStyles());
    find("search").addEventListener("keydown", (event) => this.searchKey(event));
    find("own").addEventListener("submit", (event) => {
      event.preventDefault();
      act(`rename:${find("own-name").value}`);
      find("own-name").blur();
    });
    this.buildHelp();
  }

  // ---- made once -------------------------------------------------------------------------------

  buildDiagram() {
    const { size, discs } = this.world.diagram, picture = find("diagram");
    picture.setAttribute("viewBox", `0 0 ${size[0]} ${size[1]}`);
    const group = (part, grow) => element("svg:g", { "data-part": this.world.parts[part], class: grow ? "rim" : "limb" },
      ...discs[part].map(([cx, cy, r]) => element("svg:circle", { cx, cy, r: r + grow })));
    this.world.parts.forEach((_, part) => picture.append(group(part, 2.4)));
    this.world.parts.forEach((name, part) => {
      const limb = group(part, 0);
      limb.addEventListener("click", () => this.act(`pick_${name}`));
      picture.append(limb);
    });
    for (const [letter, x] of [["R", 8], ["L", size[0] - 14]])
      picture.append(element("svg:text", { x, y: 62 }, letter));
  }

  buildParts() {
    this.rows = Object.fromEntries(this.world.parts.map((part) => {
      const dot = element("i"), style = element("span"), strength = element("b");
      const row = element("button", { className: "part", onclick: () => this.act(`pick_${part}`) },
        dot, element("small", {}, readable(part)), style, strength);
      find("parts").append(row);
      return [part, { row, dot, style, strength }];
    }));
    for (const group of Object.keys(this.world.groups)) {
      const made = element("button", { onclick: () => this.act(`pick_${group}`) }, group);
      made.dataset.group = group;
      find("groups").append(made);
    }
  }

  buildHelp() {
    find("keys").append(...this.world.help.map(([help, keys]) => element("div", {}, element("dt", {}, keys), element("dd", {}, help))));
  }

  // ---- what the server says ----------------------------------------------------------------------

  setStyles(styles) {
    this.styles = styles;
    this.colours = Object.fromEntries(styles.map(([name, colour]) => [name, colour]));
    find("search").placeholder = `search ${styles.length} styles`;
    this.showStyles();
  }

  showStyles() {
    const wanted = find("search").value.trim().toLowerCase(), blending = this.state?.blending;
    const shown = this.styles.filter(([name]) => name.includes(wanted));
    const chip = (name, colour, noncommercial, own) => {
      const label = name === this.world.own && blending ? "no blend" : name;
      const made = element("button", { className: "chip", onclick: () => this.act(`choose:${name}`) },
        element("i", { style: `background:${colour}` }), element("span", {}, label));
      if (noncommercial) made.append(element("em", { title: "for non-commercial use only" }));
      if (own) made.append(element("small", {}, "yours"));
      made.dataset.style = name;
      return made;
    };
    find("styles").replaceChildren(chip(this.world.own, this.own), ...shown.map((style) => chip(...style)));
    this.lightStyle();
  }

  lightStyle() {
    const own = this.styles.find(([name]) => name === this.state?.slot)?.[3] ?? false;
    find("own").hidden = !own;
    if (own && this.named !== this.state.slot) find("own-name").value = this.state.slot;
    this.named = own ? this.state.slot : null;
    for (const made of find("styles").children) {
      const on = made.dataset.style === this.state?.slot;
      if (on && !made.classList.contains("on")) keepInView(made);
      made.classList.toggle("on", on);
    }
  }

  searchKey(event) {
    if (event.key === "Enter") {
      const first = this.styles.find(([name]) => name.includes(event.target.value.trim().toLowerCase()));
      if (first && event.target.value.trim()) this.act(`choose:${first[0]}`);
    }
    if (event.key === "Enter" || event.key === "Escape") {
      event.target.value = "";
      event.target.blur();
      this.showStyles();
    }
    event.stopPropagation();
  }

  setPresets(presets) {
    const button = (slot) => {
      const [name, colours] = presets[slot] ?? ["", []];
      const stripes = element("span", { className: "stripes" }, ...colours.map((each) => element("i", { style: `background:${each}` })));
      const made = element("button", { onclick: () => this.act(`preset_${slot}`), title: `${name || "empty"}; right click or hold: save here` },
        stripes, element("span", {}, name || `${slot}: hold to save`));
      onHold(made, () => this.act(`save_${slot}`));
      return made;
    };
    find("presets").replaceChildren(...this.world.slots.map(button));
  }

  setState(state) {
    const before = this.state;
    this.state = state;
    this.showParts(state);
    this.showControls(state);
    find("title").hidden = !state.playing || state.replaying;
    if (before?.blending !== state.blending) this.showStyles();
    else this.lightStyle();
  }

  // The body: what each part has, and which are picked.
  showParts(state) {
    const picked = new Set(state.playing && !state.replaying ? [] : state.parts);
    for (const part of this.world.parts) {
      const [name, strength, other, share] = state.style[part] ?? [], row = this.rows[part];
      row.style.textContent = name ? (other ? `${name} › ${percent(share)} ${other}` : name) : this.world.own;
      row.strength.textContent = name ? percent(strength) : "";
      row.row.classList.toggle("own", !name);
      row.row.classList.toggle("on", picked.has(part));
      for (const limb of find("diagram").querySelectorAll(`[data-part=${part}]`))
        limb.classList.toggle("on", picked.has(part));
    }
    find("picked").textContent = readable(state.picked);
    for (const made of find("groups").children) made.classList.toggle("on", made.dataset.group === state.picked);
  }

  // Sliders and buttons.
  showControls(state) {
    const light = (id, on) => find(id).classList.toggle("on", on), colourOf = (name) => this.colours[name] ?? this.own;
    light("style-tab", !state.blending);
    light("blend-tab", state.blending);
    find("share-row").hidden = !state.blending;
    slide(find("strength"), state.strength * 100, colourOf(state.name));
    find("strength-value").textContent = state.strengths_differ ? "mixed" : percent(state.strength);
    slide(find("share"), state.share * 100, colourOf(state.other));
    find("share-value").textContent = state.shares_differ ? "mixed" : percent(state.share);
    light("record", state.recording);
    find("record").querySelector("span").textContent = state.recording ? "stop" : "record";
    find("replay").hidden = !state.recorded || state.recording;
    find("character-name").textContent = state.character || "figure";
    find("ground-name").textContent = state.ground;
    find("stylizer-name").textContent = state.stylizer;
    light("crouch-toggle", state.crouching);
    const isOn = (name) => ({ twin: Boolean(state.twin), pace: state.pace })[name] ?? state.seen.includes(name);
    for (const made of document.querySelectorAll("[data-seen]")) {
      made.classList.toggle("on", isOn(made.dataset.seen));
      made.setAttribute("aria-pressed", isOn(made.dataset.seen));
    }
  }

  // The five parts' colours, as the figure has them now.
  setColours(tints) {
    this.world.parts.forEach((part, i) => {
      const colour = css(tints.slice(3 * i, 3 * i + 3));
      if (this.rows[part].colour === colour) return;
      this.rows[part].colour = this.rows[part].dot.style.background = colour;
      find("diagram").querySelector(`.limb[data-part=${part}]`).style.fill = colour;
    });
  }

  say(text, alert = false) {
    const made = element("p", { className: alert ? "alert" : "" }, text);
    find("toasts").append(made);
    while (find("toasts").children.length > 3) find("toasts").firstChild.remove();
    setTimeout(() => made.remove(), Math.max(4000, text.length * 50));
  }

  // Figures of the last quarter of a second.
  setFigures({ frame, delay, rate, poses, bytes }) {
    find("figures").replaceChildren(...[
      ["frame", `${frame.toFixed(1)} ms`], ["delay", delay === null ? "–" : `${Math.round(delay)} ms`],
      ["pictures", `${Math.round(rate)}/s`], ["poses", `${Math.round(poses)}/s`], ["network", `${Math.round(bytes / 1000)} kB/s`],
    ].map(([name, value]) => element("span", {}, element("small", {}, name), value)));
  }
}

function css(colour) {
  return `rgb(${colour.map((channel) => Math.round(channel * 255)).join(" ")})`;
}

function slide(input, value, colour) {
  if (document.activeElement !== input || !input.matches(":active")) input.value = value;
  input.style.setProperty("--fill", `${(100 * input.value) / input.max}%`);
  input.style.setProperty("--colour", colour);
}

function keepInView(made) {
  const list = made.parentElement;
  list.scrollTo({ top: made.offsetTop - list.clientHeight / 2 + made.clientHeight / 2, left: made.offsetLeft - list.clientWidth / 2 });
}

// A right click, or a finger that stays.
function onHold(made, act) {
  let timer = 0;
  made.addEventListener("contextmenu", (event) => {
    event.preventDefault();
    if (!timer) act();
  });
  made.addEventListener("pointerdown", (event) => {
    if (event.pointerType === "touch") timer = setTimeout(act, 600);
  });
  for (const kind of ["pointerup", "pointercancel", "pointerleave"])
    made.addEventListener(kind, () => {
      clearTimeout(timer);
      timer = 0;
    });
}
