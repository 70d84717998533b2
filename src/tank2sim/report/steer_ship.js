"use strict";
// The ship: the FMI 3 library of the FMU, compiled to WebAssembly, called by its own functions; and a voyage with her.

class Ship {
  static async aboard(data) {
    const bytes = Uint8Array.from(atob(data.library), (letter) => letter.charCodeAt(0));
    const { instance } = await WebAssembly.instantiate(bytes, {});
    return new Ship(instance.exports, data);
  }

  constructor(library, data) {
    this.library = library;
    this.references = data.references;
    library._initialize();
    // Scratch memory: a value reference, a value, flags, the time come to, a state of the FMU (none yet).
    this.room = library.malloc(64);
    this.state = library.malloc(4);
    this.memory().setUint32(this.state, 0, true);
    const [name, token] = [this.#text("ship"), this.#text(data.token)];
    this.self = library.fmi3InstantiateCoSimulation(name, token, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
    if (!this.self) throw new Error("the ship in this page cannot be started");
  }

  memory() { return new DataView(this.library.memory.buffer); }

  #text(letters) {
    const bytes = new TextEncoder().encode(`${letters}\0`);
    const place = this.library.malloc(bytes.length);
    new Uint8Array(this.library.memory.buffer).set(bytes, place);
    return place;
  }

  #done(status, what) {
    if (status !== 0) throw new Error(`${what} (FMI status ${status})`);
  }

  has(name) { return name in this.references; }

  set(name, value) {
    const memory = this.memory();
    memory.setUint32(this.room, this.references[name], true);
    memory.setFloat64(this.room + 8, value, true);
    this.#done(this.library.fmi3SetFloat64(this.self, this.room, 1, this.room + 8, 1), `${name} cannot be ${value}`);
  }

  setTruth(name, value) {
    const memory = this.memory();
    memory.setUint32(this.room, this.references[name], true);
    memory.setUint8(this.room + 8, value ? 1 : 0);
    this.#done(this.library.fmi3SetBoolean(this.self, this.room, 1, this.room + 8, 1), `${name} cannot be set`);
  }

  get(name) {
    this.memory().setUint32(this.room, this.references[name], true);
    this.#done(this.library.fmi3GetFloat64(this.self, this.room, 1, this.room + 8, 1), `${name} cannot be read`);
    return this.memory().getFloat64(this.room + 8, true);
  }

  begin(values) {
    this.#done(this.library.fmi3Reset(this.self), "the ship cannot be put back");
    for (const [name, value] of Object.entries(values)) this.set(name, value);
    this.#done(this.library.fmi3EnterInitializationMode(this.self, 0, 0, 0, 0, 0), "the ship cannot begin");
    this.#done(this.library.fmi3ExitInitializationMode(this.self), "there is no start with these values");
  }

  // One Runge-Kutta step of `size` s, no longer than the model's own.
  step(time, size) {
    const at = this.room + 16;
    const status = this.library.fmi3DoStep(this.self, time, size, 0, at, at + 1, at + 2, at + 8);
    this.#done(status, `the motion leaves all bounds at ${time.toFixed(1)} s`);
  }

  keep() { this.#done(this.library.fmi3GetFMUState(this.self, this.state), "the state cannot be kept"); }

  back() {
    const kept = this.memory().getUint32(this.state, true);
    this.#done(this.library.fmi3SetFMUState(this.self, kept), "the state cannot be put back");
  }
}

// Rudder one way until the heading has changed by `heading`, then the other way, and so on: five executes, rad.
class Zigzag {
  static EXECUTES = 5;

  constructor(rudder, heading, course, latest) {
    Object.assign(this, { rudder: Math.abs(rudder), heading, course, latest });
    this.side = Math.sign(rudder);
    this.executes = 0;
    this.overshoots = [];
    this.furthest = 0;
  }

  get order() { return this.side * this.rudder; }

  beyond(psi) { return this.side * (psi - this.course) - this.heading; }

  // What the ship has swung past the last switch; called at each sample.
  watch(psi) {
    if (this.executes > 0) this.furthest = Math.max(this.furthest, -this.side * (psi - this.course) - this.heading);
  }

  // At the heading: the other way. Returns true after the last execute.
  turn() {
    if (this.executes > 0) this.overshoots.push(this.furthest);
    this.executes += 1;
    this.furthest = 0;
    if (this.executes === Zigzag.EXECUTES) return true;
    this.side = -this.side;
    return false;
  }
}

// A ship under way. Samples lie on a grid of whole steps; a switch between two of them is one more sample.
class Voyage {
  static SIGNALS = ["motion.x", "motion.y", "motion.psi", "motion.u", "motion.v", "motion.r", "rudder.angle"];
  static MOST_SAMPLES = 500000;

  constructor(ship, data) {
    this.ship = ship;
    this.step = data.step;
    this.longest = data.longest;
    this.begin(data.start);
  }

  begin(start, orders = {}) {
    this.ship.begin({ ...start, ...orders });
    this.time = 0;
    this.steps = 0;
    this.zigzag = null;
    this.programme = [];
    this.orders = { "rudder.command": 0, ...orders };
    this.samples = Object.fromEntries(["t", ...Voyage.SIGNALS, "rudder.command", "propeller.speed"].map((n) => [n, []]));
    this.#sample();
  }

  get length() { return this.samples.t.length; }

  get full() { return this.length >= Voyage.MOST_SAMPLES; }

  order(name, value) {
    this.ship.set(name, value);
    this.orders[name] = value;
    if (name in this.samples) this.samples[name][this.length - 1] = value;
  }

  startZigzag(rudder, heading) {
    this.programme = [];
    this.zigzag = new Zigzag(rudder, heading, this.ship.get("motion.psi"), this.time + this.longest);
    this.order("rudder.command", this.zigzag.order);
  }

  // Orders [{t, name: value, ...}], each held until the next, from now on.
  follow(programme) {
    this.zigzag = null;
    this.programme = programme.filter((one) => one.t >= this.time - 1e-9 * this.step);
    this.#obey();
  }

  // On to the next sample. Returns "zigzag", "programme" if that has just ended, else null.
  advance() {
    const tolerance = 1e-9 * this.step;
    const onGrid = this.time <= this.steps * this.step + tolerance;
    const grid = (this.steps + 1) * this.step;
    const ordered = this.programme[0]?.t ?? Infinity;
    const whole = ordered >= grid - tolerance;
    const size = whole ? (onGrid ? this.step : grid - this.time) : ordered - this.time;
    const before = this.time;
    if (this.zigzag) this.ship.keep();
    this.ship.step(before, size);
    if (this.zigzag?.beyond(this.ship.get("motion.psi")) >= 0) return this.#switch(before, size);
    this.time = whole ? grid : ordered;
    if (whole) this.steps += 1;
    this.#sample();
    if (this.zigzag && this.time >= this.zigzag.latest) return this.#ended("zigzag");
    return this.#obey();
  }

  // Halves the step until the heading is met within rounding, and goes there.
  #switch(before, size) {
    let [low, high] = [0, size];
    for (;;) {
      const middle = (low + high) / 2;
      if (!(before + middle > before + low && before + middle < before + high)) break;
      this.ship.back();
      this.ship.step(before, middle);
      if (this.zigzag.beyond(this.ship.get("motion.psi")) >= 0) high = middle; else low = middle;
    }
    this.ship.back();
    this.ship.step(before, high);
    this.time = before + high;
    const last = this.time >= (this.steps + 1) * this.step - 1e-9 * this.step;
    if (last) this.steps += 1;
    this.#sample();
    if (this.zigzag.turn()) return this.#ended("zigzag");
    this.order("rudder.command", this.zigzag.order);
    return null;
  }

  #obey() {
    const begun = this.programme.length > 0;
    while (this.programme[0]?.t <= this.time + 1e-9 * this.step) {
      const { t, ...orders } = this.programme.shift();
      for (const [name, value] of Object.entries(orders)) this.order(name, value);
    }
    return begun && this.programme.length === 0 ? "programme" : null;
  }

  #ended(what) {
    this.done = this.zigzag;
    this.zigzag = null;
    return what;
  }

  #sample() {
    const { samples } = this;
    samples.t.push(this.time);
    for (const name of Voyage.SIGNALS) samples[name].push(this.ship.get(name));
    for (const name of ["rudder.command", "propeller.speed"]) samples[name].push(this.orders[name] ?? 0);
    this.zigzag?.watch(samples["motion.psi"].at(-1));
  }

  // The voyage as a trial file of tank2sim, with all digits.
  csv(comment, engine) {
    const deg = (value) => value * 180 / Math.PI;
    const rpm = (value) => value * 30 / Math.PI;
    const columns = {
      t_s: ["t", Number], delta_order_deg: ["rudder.command", deg], delta_deg: ["rudder.angle", deg],
      ...(engine ? { n_rpm: ["propeller.speed", rpm] } : {}), u_mps: ["motion.u", Number], v_mps: ["motion.v", Number],
      r_degps: ["motion.r", deg], psi_deg: ["motion.psi", deg], x_m: ["motion.x", Number], y_m: ["motion.y", Number],
    };
    const rows = this.samples.t.map((_, row) =>
      Object.values(columns).map(([name, shown]) => shown(this.samples[name][row])).join(","));
    return [`# ${comment}`, Object.keys(columns).join(","), ...rows, ""].join("\n");
  }
}
