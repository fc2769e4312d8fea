// The walk: opens the bake, and draws what the hands ask for, when something has changed.

import { fetchBake } from "./bake.js";
import { fromAddress, toAddress } from "./camera.js";
import { at, atRest, isStill, step } from "./flight.js";
import { Hands } from "./hands.js";
import { pointAt } from "./pick.js";
import { openWebGl2 } from "./webgl2.js";
import { openWebGpu } from "./webgpu.js";

/** Pixels that are drawn for one of the page's, along each side: more than a phone's eye sees cost it frames. */
const MOST_PIXELS = 2;

/** Seconds that a frame moves on by at most: a page that slept does not leap. */
const LONGEST_STEP = 0.25;

/** Stops that the slider reaches to either side of the exposure that the walk began with. */
const STOPS = 8;

/** Stops that a key changes the exposure by. */
const STOP = 0.5;

/** Frames of which the median is told. */
const FRAMES = 31;

/** Seconds within which a device that is lost again is not opened again. */
const LASTING = 10;

const element = (id) => document.getElementById(id);

/** Says something over the picture; nothing takes it away. */
function say(what) {
  element("message").textContent = what;
  element("message").hidden = !what;
}

/** What can draw a bake in a mode: the API that is asked for, else WebGPU where there is one, else WebGL2. */
async function openRenderer(bake, wanted, mode) {
  const reasons = [];
  for (const [name, open] of [["webgpu", openWebGpu], ["webgl2", openWebGl2]]) {
    if (wanted && wanted !== name) continue;
    // A canvas that has had a context of one API gives none of the other, and one whose context was lost none at all.
    const canvas = document.createElement("canvas");
    try {
      const renderer = await open(canvas, bake);
      if (renderer) {
        await renderer.prepare(mode);
        element("stage").replaceChildren(canvas);
        return { ...renderer, canvas };
      }
      reasons.push(`this browser gives no ${name}`);
    } catch (error) {
      reasons.push(`${name}: ${error.message}`);
    }
  }
  if (reasons.length === 0) throw new Error(`?api=${wanted} is neither webgpu nor webgl2.`);
  const cure = "Another browser may have one, or this one's settings may allow graphics acceleration.";
  throw new Error(`The walk needs WebGPU or WebGL2: ${reasons.join("; ")}. ${cure}`);
}

/** A walk through a bake, from what the page's address says of it. */
class Walk {
  #bake;
  #api;
  #renderer;
  #hands;
  #flight;
  #ev;
  /** Whether the exposure is one's own, and not the camera's. */
  #evIsOwn;
  /** The point that is gone around while the right button is held. */
  #pivot = null;
  #mode = 0;
  #curve = 0;
  #size = [0, 0];
  /** When the last frame was drawn, milliseconds, while something moves. */
  #last = null;
  #isDue = false;
  #times = [];
  /** When a lost device was opened again last, milliseconds. */
  #reopened = -Infinity;

  constructor(bake, api) {
    this.#bake = bake;
    this.#api = api;
    const { head } = bake;
    const first = head.cameras[0] ?? head.overview;
    this.#flight = atRest(first, head.size);
    this.#ev = first.ev;
    this.#furnish(first.ev);
    this.#follow(location.hash);
    addEventListener("hashchange", () => this.#follow(location.hash));
    this.#hands = new Hands(element("stage"), () => this.#wake(), (code) => this.#press(code));
    new ResizeObserver(() => {
      const { clientWidth, clientHeight } = element("stage");
      const pixels = Math.min(devicePixelRatio, MOST_PIXELS);
      this.#size = [clientWidth, clientHeight].map((side) => Math.max(1, Math.round(side * pixels)));
      this.#wake();
    }).observe(element("stage"));
  }

  /** Opens what draws; once more when it is lost. */
  async open() {
    const mode = this.#mode;
    const renderer = await openRenderer(this.#bake, this.#api, mode);
    const asked = this.#mode;
    this.#mode = mode;
    this.#renderer = renderer;
    renderer.lost.then((why) => this.#reopen(why));
    say("");
    // Another mode may have been asked for meanwhile.
    await this.#show(asked);
  }

  async #reopen(why) {
    this.#renderer = null;
    if (performance.now() - this.#reopened < 1000 * LASTING) {
      say(`The graphics device was lost again (${why}). Reload the page to try once more.`);
      return;
    }
    this.#reopened = performance.now();
    say(`The graphics device was lost (${why}), and is opened again.`);
    await this.open().catch((error) => say(error.message));
  }

  /** Fills the panel. */
  #furnish(ev) {
    const { head } = this.#bake;
    document.title = `${head.name} – Halflight`;
    element("name").textContent = head.name;
    element("bake").download = `${head.name}.hlf`;
    const choice = (id, names, chosen) => {
      element(id).replaceChildren(...names.map((name, number) => new Option(name, number)));
      element(id).addEventListener("change", () => {
        chosen(Number(element(id).value));
        // Keys walk again.
        element(id).blur();
      });
    };
    choice("camera", [...head.cameras, head.overview].map((camera) => camera.name), (number) => this.#visit(number));
    choice("mode", head.modes.map((mode) => mode.name), (number) => this.#show(number));
    choice("curve", head.curves, (number) => this.#bend(number));
    Object.assign(element("ev"), { min: ev - STOPS, max: ev + STOPS, step: 0.1 });
    element("ev").addEventListener("input", () => this.#expose(Number(element("ev").value)));
    element("ev").addEventListener("change", () => element("ev").blur());
  }

  /** Goes where an address says. */
  #follow(hash) {
    const { camera, ev, mode, curve } = fromAddress(hash);
    if (camera) this.#flight = at(this.#flight, camera);
    this.#evIsOwn = ev !== undefined;
    this.#ev = ev ?? this.#ev;
    this.#curve = Math.max(0, this.#bake.head.curves.indexOf(curve));
    this.#show(Math.max(0, this.#bake.head.modes.findIndex(({ name }) => name === mode)));
  }

  #press(code) {
    const { modes, curves, cameras } = this.#bake.head;
    const digit = /^(?:Digit|Numpad)([1-9])$/.exec(code);
    if (digit && digit[1] <= cameras.length) this.#visit(digit[1] - 1);
    else if (code === "KeyF") this.#visit(cameras.length);
    else if (code === "KeyM") this.#show((this.#mode + 1) % modes.length);
    else if (code === "KeyT") this.#bend((this.#curve + 1) % curves.length);
    else if (code === "BracketLeft") this.#expose(this.#ev - STOP);
    else if (code === "BracketRight") this.#expose(this.#ev + STOP);
    else if (code === "KeyH") element("panel").hidden = !element("panel").hidden;
  }

  /** Goes to a camera of the scene, by its number; the one after the last sees all of it. */
  #visit(number) {
    const { cameras, overview } = this.#bake.head;
    const camera = cameras[number] ?? overview;
    this.#flight = at(this.#flight, camera);
    if (!this.#evIsOwn) this.#ev = camera.ev;
    this.#wake();
  }

  async #show(mode) {
    const renderer = this.#renderer;
    try {
      await renderer?.prepare(mode);
    } catch (error) {
      return say(error.message);
    }
    // What draws now may not be what was asked.
    if (renderer !== this.#renderer) return this.#show(mode);
    this.#mode = mode;
    this.#wake();
  }

  #bend(curve) {
    this.#curve = curve;
    this.#wake();
  }

  #expose(ev) {
    this.#ev = ev;
    this.#evIsOwn = true;
    this.#wake();
  }

  /** Has a frame drawn, if none is due. */
  #wake() {
    if (this.#isDue) return;
    this.#isDue = true;
    requestAnimationFrame((now) => this.#frame(now));
  }

  #frame(now) {
    this.#isDue = false;
    const seconds = this.#last === null ? 0 : Math.min((now - this.#last) / 1000, LONGEST_STEP);
    const steering = this.#hands.take();
    this.#pivot = steering.orbit && (this.#pivot ?? this.#pointAt(steering.orbit));
    this.#flight = step(this.#flight, { ...steering, around: this.#pivot }, seconds);
    this.#draw();
    if (this.#last !== null) this.#times = [...this.#times.slice(1 - FRAMES), now - this.#last];
    const moves = steering.motion.some((way) => way !== 0) || !isStill(this.#flight);
    this.#last = moves ? now : null;
    this.#tell();
    if (moves) this.#wake();
    else history.replaceState(null, "", toAddress(this.#view()));
  }

  /** What is seen at a place of the page. */
  #pointAt([x, y]) {
    const { corners, head } = this.#bake;
    const { clientWidth: width, clientHeight: height } = element("stage");
    const numbers = new Float32Array(corners.buffer, corners.byteOffset, corners.length);
    return pointAt(numbers, this.#flight.camera, [x / width, y / height], width / height, head.size / 2);
  }

  #draw() {
    const [width, height] = this.#size;
    if (!this.#renderer || width * height === 0) return;
    const { canvas } = this.#renderer;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const { camera } = this.#flight;
    const [mode, light] = [this.#mode, this.#bake.head.modes[this.#mode].light];
    this.#renderer.draw({ camera, width, height, ev: this.#ev, mode, light, curve: this.#curve });
  }

  /** What the address says of the view. */
  #view() {
    const { modes, curves } = this.#bake.head;
    return { camera: this.#flight.camera, ev: this.#ev, mode: modes[this.#mode].name, curve: curves[this.#curve] };
  }

  /** Brings the panel up to date. */
  #tell() {
    const { head } = this.#bake;
    element("mode").value = this.#mode;
    element("curve").value = this.#curve;
    element("ev").value = this.#ev;
    element("stops").textContent = this.#ev.toFixed(1);
    // A list that shows no camera says that one is at none.
    const isHere = ({ eye }) => String(eye) === String(this.#flight.camera.eye);
    element("camera").selectedIndex = [...head.cameras, head.overview].findIndex(isHere);
    const median = [...this.#times].sort((a, b) => a - b)[this.#times.length >> 1];
    const times = median ? `, ${median.toFixed(1)} ms a frame` : "";
    const [triangles, error] = [head.triangles.toLocaleString("en"), (100 * head.error[0]).toFixed(2)];
    const api = this.#renderer?.name ?? "nothing";
    element("status").textContent = `${triangles} triangles, error ${error} %; ${api} draws${times}`;
  }
}

try {
  const progress = (part) => say(`${Math.round(100 * part)} % of the bake is here.`);
  const bake = await fetchBake(new URL("./", import.meta.url), progress);
  say("The picture is made ready.");
  await new Walk(bake, new URLSearchParams(location.search).get("api")).open();
} catch (error) {
  say(error.message);
}
