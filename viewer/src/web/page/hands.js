// The hands: keys, mouse and fingers, gathered into what steers a flight.

/** Keys by their place on the keyboard, and the way that they move: right, up, forward. */
const MOTION = {
  KeyW: [0, 0, 1], ArrowUp: [0, 0, 1], KeyS: [0, 0, -1], ArrowDown: [0, 0, -1],
  KeyD: [1, 0, 0], ArrowRight: [1, 0, 0], KeyA: [-1, 0, 0], ArrowLeft: [-1, 0, 0],
  KeyE: [0, 1, 0], PageUp: [0, 1, 0], KeyQ: [0, -1, 0], PageDown: [0, -1, 0],
};

/** Pixels that two fingers are moved by for the full speed: a thumb's reach. */
const FULL_SPEED = 80;

/** Pixels, and lines, that browsers scroll by for a notch of the wheel. */
const NOTCH = [100, 3, 1];

/** What the hands do on an element; `woken` is called when they do anything, `pressed` with the code of any other key. */
export class Hands {
  #held = new Set();
  #pointers = new Map();
  /** Where the middle of two fingers was when the second came down. */
  #start = null;
  #look = [0, 0];
  #wheel = 0;
  #fast = false;
  #slow = false;

  constructor(element, woken, pressed) {
    const listen = (target, type, heard) =>
      target.addEventListener(type, (event) => (heard(event), woken()), { passive: false });
    listen(window, "keydown", (event) => this.#key(event, pressed));
    listen(window, "keyup", (event) => (this.#held.delete(event.code), this.#modifiers(event)));
    listen(window, "blur", () => this.#held.clear());
    listen(element, "pointerdown", (event) => {
      this.#pointers.set(event.pointerId, [event.clientX, event.clientY]);
      this.#start = this.#middle();
    });
    // Of the window: a drag goes on where it leaves the picture.
    listen(window, "pointermove", (event) => this.#drag(event));
    for (const type of ["pointerup", "pointercancel"]) {
      listen(window, type, (event) => (this.#pointers.delete(event.pointerId), (this.#start = this.#middle())));
    }
    listen(element, "wheel", (event) => {
      event.preventDefault();
      this.#wheel -= event.deltaY / NOTCH[event.deltaMode];
    });
    listen(element, "contextmenu", (event) => event.preventDefault());
  }

  /** What the hands have done since this was asked last, and what they hold, as `flight.js` steers by. */
  take() {
    const steering = {
      motion: this.#motion(),
      look: this.#look,
      wheel: this.#wheel,
      fast: this.#fast,
      slow: this.#slow,
    };
    this.#look = [0, 0];
    this.#wheel = 0;
    return steering;
  }

  #key(event, pressed) {
    this.#modifiers(event);
    // What is typed into a control of the page, or asked of the browser, is theirs.
    if (event.target.closest?.("input, select, a, summary") || event.metaKey || event.altKey) return;
    if (event.code in MOTION) {
      this.#held.add(event.code);
      event.preventDefault();
    } else if (!event.repeat && !event.ctrlKey) {
      pressed(event.code);
    }
  }

  #modifiers(event) {
    this.#fast = event.shiftKey;
    this.#slow = event.ctrlKey;
  }

  #drag(event) {
    const before = this.#pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    this.#pointers.set(event.pointerId, now);
    if (this.#pointers.size > 1) return;
    // A mouse turns the head; a finger holds the picture.
    const sign = event.pointerType === "touch" ? -1 : 1;
    this.#look = this.#look.map((sum, i) => sum + sign * (now[i] - before[i]));
  }

  #motion() {
    const motion = [0, 0, 0];
    for (const code of this.#held) MOTION[code].forEach((way, i) => (motion[i] += way));
    const middle = this.#middle();
    if (middle) {
      const part = (i) => Math.max(-1, Math.min(1, (middle[i] - this.#start[i]) / FULL_SPEED));
      motion[0] += part(0);
      motion[2] -= part(1);
    }
    return motion;
  }

  /** Between two fingers, or nowhere. */
  #middle() {
    const [a, b, ...more] = this.#pointers.values();
    return b && !more.length ? [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2] : null;
  }
}
