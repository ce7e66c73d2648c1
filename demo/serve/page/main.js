// The page: loads what it needs from its server, then shows the newest frame that came over the socket in each picture.

import { Camera } from "./camera.js";
import { find } from "./dom.js";
import { Film } from "./film.js";
import { Heights } from "./ground.js";
import { Input } from "./input.js";
import { Insight } from "./insight.js";
import { load, readModel } from "./model.js";
import { Panel } from "./panel.js";
import { readPacket, Skeleton } from "./poses.js";
import { Scene, toPixels } from "./scene.js";

const NARROW = 720; // pixels of width up to which panels lie under the picture, see style.css
const REACH = 34; // pixels from a bone within which a tap means its part
const SLOW = 25; // pictures a second under which fewer pixels are drawn, and no picture waits for another to be drawn
const LEAST_SHARP = 0.5;
const PAST_FRAMES = 30, PAST_STEP = 6; // of the last half second, and every which of them is drawn
const FIGURES_SECONDS = 0.25, GLOW_SECONDS = 0.5, ATTRACT_ORBIT = 0.12;

class Page {
  constructor(world, figure) {
    this.world = world;
    const canvas = find("scene");
    this.camera = new Camera(world.camera);
    this.scene = new Scene(canvas, world, figure, new Skeleton(world));
    this.panel = new Panel(world, (action) => this.act(action));
    this.insight = new Insight();
    this.film = new Film(canvas, (name, content) => this.download(name, URL.createObjectURL(content)));
    this.past = []; // frames, the newest first
    this.input = new Input(canvas, world, this.camera, {
      act: (action) => this.act(action),
      send: (said) => this.send(said),
      tap: (x, y) => this.tap(x, y),
    });
    this.frame = this.state = this.ground = null;
    this.glowing = {}; // part -> when it was picked
    this.sharpness = 1; // share of the screen's own pixels that are drawn: less where drawing takes too long
    this.isSlow = false;
    this.pictures = 0;
    this.counts = { pictures: 0, bytes: 0, since: performance.now(), delay: null, frames: 0 };
    this.listen();
    this.connect();
    this.resize();
    this.last = performance.now();
    requestAnimationFrame((now) => this.draw(now));
  }

  // ---- to and fro ------------------------------------------------------------------------------

  connect() {
    this.socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = ({ data }) => (typeof data === "string" ? this.takeMessage(JSON.parse(data)) : this.takeFrame(data));
    this.socket.onclose = () => {
      if (this.refused) return;
      showNotice("The connection to the server is lost: trying again …");
      setTimeout(() => this.connect(), 1500);
    };
    this.socket.onopen = () => {
      showNotice(this.drawn ? "" : "Starting your character …");
      this.input.last = "";
      if (document.hidden) this.send({ hidden: true });
    };
  }

  send(said) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(said));
    return true;
  }

  takeFrame(bytes) {
    this.frame = readPacket(bytes, this.world.packet);
    this.past.unshift(this.frame);
    this.past.length = Math.min(this.past.length, PAST_FRAMES);
    this.counts.frames += 1;
    this.counts.bytes += bytes.byteLength;
  }

  takeMessage(said) {
    if (said.welcome) this.word = said.welcome;
    if (said.full) {
      this.refused = true;
      showNotice(said.full);
    }
    if (said.say) this.panel.say(said.say, said.alert);
    if (said.styles) this.panel.setStyles(said.styles);
    if (said.presets) this.panel.setPresets(said.presets);
    if (said.file) this.save(said.file);
    if (said.model) this.loadCharacter();
    if (said.state) this.setState(said.state);
    if (said.attention) this.insight.setAttention(said.attention, this.panel.colours);
  }

  setState(state) {
    if (this.state && !state.playing && this.state.picked !== state.picked) this.glow(state.parts);
    if (state.ground !== this.ground) this.changeGround(state.ground);
    this.state = state;
    this.panel.setState(state);
    this.insight.setState(state);
  }

  async changeGround(name) {
    this.ground = name;
    const bytes = await (await load(`/ground/${this.world.grounds.indexOf(name)}`)).arrayBuffer();
    if (this.ground === name) this.scene.standOn(bytes.byteLength ? new Heights(bytes) : null);
  }

  // The user's character is ready to be fetched.
  async loadCharacter() {
    this.scene.setCharacter(await readModel(await (await load(`/model/${this.word}`)).arrayBuffer()));
  }

  save(name) {
    this.download(name, `/take/${this.word}/${encodeURIComponent(name)}`);
  }

  download(name, address) {
    const link = document.createElement("a");
    link.href = address;
    link.download = name;
    link.click();
    this.panel.say(`saved ${name}`);
    this.showFilm();
  }

  showFilm() {
    find("film").classList.toggle("on", this.film.running);
    find("film").querySelector("span").textContent = this.film.running ? "stop" : "film";
  }

  async drop(files) {
    const form = new FormData();
    for (const file of files) form.append("files", file, file.name);
    try {
      const response = await fetch(`/drop/${this.word}`, { method: "POST", body: form });
      const said = response.headers.get("content-type")?.includes("json") ? await response.json() : null;
      this.panel.say(said?.say ?? "the files were too large: 64 MB at most", !response.ok);
    } catch {
      this.panel.say("the files did not come through; drop them again", true);
    }
  }

  // ---- what is asked for ---------------------------------------------------------------------------

  act(action) {
    const local = LOCAL[action];
    if (local) local(this);
    else this.send({ do: action });
  }

  tap(x, y) {
    if (!this.drawn) return;
    const { poses, worldToClip } = this.drawn, box = find("scene").getBoundingClientRect();
    const at = toPixels(poses[0].positions, worldToClip, box.width, box.height);
    let nearest = REACH, part = null;
    at.forEach((stop, joint) => {
      const parent = this.world.parents[joint];
      if (parent < 0) return;
      const start = at[parent], along = [stop[0] - start[0], stop[1] - start[1]];
      const length = Math.max(along[0] ** 2 + along[1] ** 2, 1e-9);
      const share = Math.min(Math.max(((x - start[0]) * along[0] + (y - start[1]) * along[1]) / length, 0), 1);
      const away = Math.hypot(start[0] + share * along[0] - x, start[1] + share * along[1] - y);
      if (away < nearest) [nearest, part] = [away, this.world.parts[this.world.part_of_joint[parent]]];
    });
    if (part) this.act(`pick_${part}`);
  }

  glow(parts) {
    for (const part of parts) this.glowing[part] = performance.now();
  }

  listen() {
    addEventListener("resize", () => this.resize());
    find("scene").addEventListener("webglcontextlost", () => showNotice("The graphics card stopped drawing: load the page anew."));
    document.addEventListener("visibilitychange", () => this.send({ hidden: document.hidden }));
    // Space and Enter are keys of ours: a button that was clicked does not take them.
    addEventListener("click", ({ detail, target }) => detail && target.closest("button")?.blur());
    addEventListener("dragover", (event) => event.preventDefault());
    addEventListener("drop", (event) => {
      event.preventDefault();
      if (event.dataTransfer.files.length) this.drop(event.dataTransfer.files);
    });
    find("file").addEventListener("change", ({ target }) => {
      if (target.files.length) this.drop(target.files);
      target.value = "";
    });
    this.input.listenStick(find("stick"));
    for (const button of document.querySelectorAll("[data-hold]")) this.input.listenHold(button, button.dataset.hold);
    addEventListener("touchstart", () => document.body.classList.add("touch"), { once: true, passive: true });
    const room = new ResizeObserver(() => this.resize());
    for (const id of ["dress", "title", "options", "figures"]) room.observe(find(id));
  }

  resize() {
    const canvas = find("scene"), ratio = Math.min(devicePixelRatio, 2) * this.sharpness, box = canvas.getBoundingClientRect();
    this.size = [box.width, box.height].map((side) => Math.max(1, Math.round(side * ratio)));
    const dress = find("dress"), taken = dress.hidden ? null : dress.getBoundingClientRect();
    const narrow = box.width <= NARROW, left = taken && !narrow ? taken.right : 0;
    const over = ["bar", "figures", "title"].map((id) => find(id).getBoundingClientRect().bottom);
    const top = narrow ? Math.max(...over) : 0, bottom = taken && narrow ? taken.top : box.height;
    const options = find("options").getBoundingClientRect(), right = narrow || !options.width ? box.width : options.left;
    this.camera.makeRoom(left, top, right, bottom, box.width, box.height);
  }

  // ---- a picture ---------------------------------------------------------------------------------

  draw(now) {
    requestAnimationFrame((next) => this.draw(next));
    const seconds = Math.min((now - this.last) / 1000, 0.1), { frame, state, camera } = this;
    this.last = now;
    if (!frame || !state || (this.isSlow && this.scene.isBusy)) return;
    if (!this.drawn) {
      document.body.classList.add("drawn");
      showNotice("");
    }
    const canvas = find("scene"); // a canvas that gets another size is empty: only now, as it is drawn anew
    if (!this.film.running && (canvas.width !== this.size[0] || canvas.height !== this.size[1]))
      [canvas.width, canvas.height] = this.size;
    this.input.step(seconds);
    const [x, z] = [frame.root[0], frame.root[2]], [height, riseX, riseZ] = frame.plane;
    if (frame.playing && !state.replaying) camera.orbit(ATTRACT_ORBIT * seconds, 0);
    camera.follow([x, height + riseX * x + riseZ * z, z], seconds, this.scene.heights);
    this.drawn = this.scene.draw(frame, camera, this.shown(now));
    if (state.seen.includes("phase")) this.insight.setPhase(frame);
    const delay = this.input.answered(frame.answers);
    if (delay !== null) this.counts.delay = delay;
    this.panel.setColours(this.scene.tints);
    this.count(now);
  }

  // What is shown besides the character.
  shown(now) {
    const { frame, state } = this, glow = {};
    for (const [part, at] of Object.entries(this.glowing)) glow[part] = Math.max(0, 1 - (now - at) / 1000 / GLOW_SECONDS);
    const shown = { twin: frame.twin ? state.twin : "", glow };
    for (const name of state.seen) shown[name] = true;
    shown.past = shown.onion ? this.past.filter((_, i) => i && i % PAST_STEP === 0) : [];
    return shown;
  }

  // Once a picture: what the line of figures says, four times a second.
  count(now) {
    const counts = this.counts, seconds = (now - counts.since) / 1000;
    counts.pictures += 1;
    this.pictures += 1;
    if (seconds < FIGURES_SECONDS) return;
    this.isSlow = counts.pictures / seconds < SLOW;
    if (this.isSlow && this.sharpness > LEAST_SHARP && !document.hidden) {
      this.sharpness = Math.max(LEAST_SHARP, this.sharpness * 0.8);
      this.resize();
    }
    const { timed, microseconds } = this.world.packet, times = {};
    timed.forEach((name, i) => (times[name] = (this.frame.times[i] * microseconds) / 1000));
    const rate = (count) => counts[count] / seconds;
    this.panel.setFigures({ frame: times.frame, delay: counts.delay, rate: rate("pictures"), bytes: rate("bytes"), poses: rate("frames") });
    if (this.state.seen.includes("times")) this.insight.setTimes(times);
    Object.assign(counts, { pictures: 0, bytes: 0, frames: 0, since: now });
  }
}

// A sentence over the whole page, as long as there is nothing to see; an empty one hides it.
function showNotice(text) {
  find("lost").hidden = !text;
  find("lost").querySelector("p").textContent = text;
}

function toggleHelp() {
  find("help").hidden = !find("help").hidden;
}

// What the page does by itself.
const LOCAL = {
  zoom_in: ({ camera }) => camera.zoom(1),
  zoom_out: ({ camera }) => camera.zoom(-1),
  search: (page) => {
    find("dress").hidden = false;
    page.resize();
    find("search").focus();
  },
  panels: (page) => {
    document.body.classList.toggle("bare");
    find("dress").hidden = document.body.classList.contains("bare");
    page.resize();
  },
  dress: (page) => {
    find("dress").hidden = !find("dress").hidden;
    page.resize();
  },
  help: toggleHelp,
  menu: toggleHelp,
  leave: () => (find("help").hidden = true),
  options: (page) => {
    find("options").classList.toggle("open");
    page.resize();
  },
  add: () => find("file").click(),
  video: (page) => {
    try {
      page.film.toggle();
    } catch (error) {
      page.panel.say(error.message, true);
    }
    page.showFilm();
  },
  full_screen: () => (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen()),
  screenshot: (page) => {
    page.scene.draw(page.frame, page.camera, { twin: "" });
    page.download("patchwalk.png", find("scene").toDataURL());
  },
};

try {
  const [world, figure] = await Promise.all([
    load("/world.json").then((response) => response.json()),
    load("/figure").then(async (response) => readModel(await response.arrayBuffer())),
  ]);
  if (matchMedia(`(max-width: ${NARROW}px)`).matches) find("dress").hidden = true;
  window.page = new Page(world, figure);
} catch (error) {
  console.error(error);
  showNotice(error.message);
}
