"use strict";
// Ships: the equations of the model (EQUATIONS), their states, inputs and parameters, and Runge-Kutta steps.

class Ship {
  static TRIM_STEPS = 50;
  static TRIM_ACCURACY = 1e-10;

  constructor(data) {
    this.data = data;
    this.places = data.places;
    const count = data.limits.length;
    this.x = new Float64Array(count);
    this.u = Float64Array.from(data.inputs);
    this.p = Float64Array.from(data.parameters);
    this.c = new Float64Array(data.constants);
    this.y = new Float64Array(data.outputs);
    this.k = Array.from({ length: 4 }, () => new Float64Array(count));
    this.next = new Float64Array(count);
    this.stale = true;
  }

  // One more ship with the same equations.
  another() { return new Ship(this.data); }

  has(name) { return name in this.places; }

  set(name, value) {
    const [block, place] = this.places[name];
    const [low, high] = this.data.bounds[name] ?? [1, 0];
    if (!(value >= low && value <= high)) throw new Error(`${name} cannot be ${value}`);
    this[block][place] = value;
    if (block === "p") EQUATIONS.constants(this.p, this.c);
    this.stale = true;
  }

  setTruth(name, value) { this.set(name, value ? 1 : 0); }

  #value([block, place]) {
    if (block === "y" && this.stale) {
      EQUATIONS.outputs(this.x, this.u, this.p, this.y);
      this.stale = false;
    }
    return this[block][place];
  }

  get(name) { return this.#value(this.places[name]); }

  // A function that reads these signals; the array that it returns holds until the next call.
  reader(names) {
    const found = new Float64Array(names.length);
    const places = names.map((name) => this.places[name]);
    return () => {
      for (let at = 0; at < places.length; ++at) found[at] = this.#value(places[at]);
      return found;
    };
  }

  begin(values) {
    this.u.set(this.data.inputs);
    this.p.set(this.data.parameters);
    for (const [name, value] of Object.entries(values)) this.set(name, value);
    EQUATIONS.constants(this.p, this.c);
    EQUATIONS.initial(this.p, this.x);
    if (this.data.trimSwitch !== null && this.p[this.data.trimSwitch] && EQUATIONS.trimmed) this.#trim();
    this.stale = true;
    if (!this.#plausible(this.x)) throw new Error("there is no start with these values");
  }

  #trim() {
    const start = this.x.slice();
    for (let round = 0; round < Ship.TRIM_STEPS; ++round) {
      EQUATIONS.trimmed(this.x, this.u, this.p, this.next);
      const settled = this.x.every((value, at) => {
        const size = Math.max(this.data.nominal[at], Math.abs(this.next[at]));
        return Math.abs(this.next[at] - value) <= Ship.TRIM_ACCURACY * size;
      });
      this.x.set(this.next);
      if (settled) return;
    }
    this.x.set(start);
  }

  #plausible(states) {
    for (let at = 0; at < states.length; ++at) if (!(Math.abs(states[at]) <= this.data.limits[at])) return false;
    return true;
  }

  #rates(share, slope, into) {
    let states = this.x;
    if (slope) {
      states = this.next;
      for (let at = 0; at < states.length; ++at) states[at] = this.x[at] + share * slope[at];
    }
    EQUATIONS.rates(states, this.u, this.p, this.c, into);
  }

  // One Runge-Kutta step of `size` s, no longer than the model's own.
  step(time, size) {
    const [first, second, third, fourth] = this.k;
    this.#rates(0, null, first);
    this.#rates(size / 2, first, second);
    this.#rates(size / 2, second, third);
    this.#rates(size, third, fourth);
    const part = size / 6;
    for (let at = 0; at < this.x.length; ++at) {
      this.next[at] = this.x[at] + part * (first[at] + 2 * second[at] + 2 * third[at] + fourth[at]);
    }
    if (!this.#plausible(this.next)) throw new Error(`the motion leaves all bounds at ${time.toFixed(1)} s`);
    this.x.set(this.next);
    this.stale = true;
  }

  keep() { this.kept = [this.x.slice(), this.u.slice(), this.p.slice(), this.c.slice()]; }

  back() {
    [this.x, this.u, this.p, this.c].forEach((values, at) => values.set(this.kept[at]));
    this.stale = true;
  }
}
