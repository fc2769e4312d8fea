// The hands: keys, mouse and fingers, gathered into what steers a flight.

/** Keys by their place on the keyboard, and the way that they move: right, up, forward. */
const MOTION = {
  KeyW: [0, 0, 1], ArrowUp: [0, 0, 1], KeyS: [0, 0, -1], ArrowDown: [0, 0, -1],
  KeyD: [1, 0, 0], ArrowRight: [1, 0, 0], KeyA: [-1, 0, 0], ArrowLeft: [-1, 0, 0],
  KeyE: [0, 1, 0], PageUp: [0, 1, 0], KeyQ: [0, -1, 0], PageDown: [0, -1, 0],
};

/** The key that slows. Not Ctrl, as in the program's window: with W it closes the page. */
const SLOW = "Space";

/** Pixels that two fingers are moved by for the full speed: a thumb's reach. */
const FULL_SPEED = 80;

/** Pixels, lines and pages that browsers scroll by for a notch of the wheel. */
const NOTCH = [100, 3, 1];

/** The right button, in the bits of those that are held. */
const RIGHT = 2;

/**
 * What the hands do on an element; `woken` is called when they do something, `pressed` with the code of any other key.
 */
export class Hands {
  #held = new Set();
  #pointers = new Map();
  /** Where the middle of two fingers was when the second came down. */
  #start = null;
  /** Where the right button was pressed that is held, pixels of the page. */
  #orbit = null;
  #look = [0, 0];
  #wheel = 0;
  #fast = false;

  constructor(element, woken, pressed) {
    // What is heard wakes where it says so.
    const listen = (target, type, hear) =>
      target.addEventListener(type, (event) => hear(event) && woken(), { passive: false });
    listen(window, "keydown", (event) => this.#press(event, pressed));
    listen(window, "keyup", (event) => {
      this.#fast = event.shiftKey;
      return this.#held.delete(event.code);
    });
    listen(window, "blur", () => this.#held.clear());
    listen(element, "pointerdown", (event) => {
      const place = [event.clientX, event.clientY];
      this.#pointers.set(event.pointerId, place);
      this.#start = this.#middle();
      this.#orbit = event.buttons & RIGHT ? place : null;
    });
    // Of the window: a drag goes on where it leaves the picture.
    listen(window, "pointermove", (event) => this.#drag(event));
    for (const type of ["pointerup", "pointercancel"]) {
      listen(window, type, (event) => {
        this.#pointers.delete(event.pointerId);
        this.#start = this.#middle();
        this.#orbit = null;
        return true;
      });
    }
    listen(element, "wheel", (event) => {
      event.preventDefault();
      this.#wheel -= event.deltaY / NOTCH[event.deltaMode];
      return true;
    });
    listen(element, "contextmenu", (event) => event.preventDefault());
  }

  /** What the hands have done since this was asked last, and what they hold, as `flight.js` steers by; with `orbit`. */
  take() {
    const steering = {
      motion: this.#motion(),
      look: this.#look,
      wheel: this.#wheel,
      fast: this.#fast,
      slow: this.#held.has(SLOW),
      orbit: this.#orbit,
    };
    this.#look = [0, 0];
    this.#wheel = 0;
    return steering;
  }

  #press(event, pressed) {
    this.#fast = event.shiftKey;
    // What is typed into a control of the page, or asked of the browser, is theirs.
    if (event.target.closest?.("input, select") || event.ctrlKey || event.metaKey || event.altKey) return false;
    const isHeld = event.code in MOTION || (event.code === SLOW && !event.target.closest?.("a, summary"));
    if (isHeld) {
      this.#held.add(event.code);
      event.preventDefault();
    } else if (!event.repeat) {
      pressed(event.code);
    }
    return isHeld;
  }

  #drag(event) {
    const before = this.#pointers.get(event.pointerId);
    if (!before) return false;
    const now = [event.clientX, event.clientY];
    this.#pointers.set(event.pointerId, now);
    if (this.#pointers.size === 1) {
      // A mouse turns the head; a finger holds the picture.
      const sign = event.pointerType === "touch" ? -1 : 1;
      this.#look = this.#look.map((sum, i) => sum + sign * (now[i] - before[i]));
    }
    return true;
  }

  #motion() {
    const motion = [0, 0, 0];
    for (const code of this.#held) MOTION[code]?.forEach((way, i) => (motion[i] += way));
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
