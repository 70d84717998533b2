// A voyage with the ship: its orders, the zigzag, and the record of the motion.

// Rudder one way until the heading has changed by `heading`, then the other way, and so on: five executes, rad.
class Zigzag {
  static EXECUTES = 5;

  // `unit` is that in which the order is shown, rad or rad/s: of a craft with thrusters it is a difference of revolutions.
  constructor(rudder, heading, course, latest, unit) {
    Object.assign(this, { rudder: Math.abs(rudder), heading, course, latest, unit });
    this.side = this.first = Math.sign(rudder);
    this.executes = 0;
    this.overshoots = [];
    this.furthest = 0;
  }

  get order() { return this.side * this.rudder; }

  beyond(psi) { return this.side * (psi - this.course) - this.heading; }

  // What the ship has swung past the last switch; called at each step.
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

// Columns of samples, at most `most` rows. When they are full every second row goes, and of what follows fewer are
// kept; the last row is always that of now.
class Record {
  static MOST = 100000; // even, so that the last row stays; the longest zigzag of a bundled ship has fewer

  constructor(names, most = Record.MOST) {
    this.columns = Object.fromEntries(names.map((name) => [name, []]));
    this.lists = Object.values(this.columns);
    this.most = most;
    this.stride = 1;
    this.passing = false;
  }

  get length() { return this.columns.t.length; }

  // One row, in the order of the names; if it is `passing` the next takes its place.
  add(row, passing = false) {
    const place = this.passing ? this.length - 1 : this.length;
    for (let column = 0; column < row.length; column += 1) this.lists[column][place] = row[column];
    this.passing = passing;
    if (this.length > this.most) this.#thin();
  }

  // A value of the last row, which stays.
  change(name, value) {
    if (name in this.columns) this.columns[name][this.length - 1] = value;
    this.passing = false;
  }

  #thin() {
    for (const [name, column] of Object.entries(this.columns)) {
      this.columns[name] = column.filter((_, row) => row % 2 === 0);
    }
    this.lists = Object.values(this.columns);
    this.stride *= 2;
  }
}

// A ship under way. Steps lie on a grid of whole ones; a switch or an order between two of them is one more sample.
class Voyage {
  static POSE = ["motion.x", "motion.y", "motion.psi"];
  static MOTION = [...Voyage.POSE, "motion.u", "motion.v", "motion.r"];
  static WIND = ["wind.speed", "wind.direction"];

  // `signals` and `most` rows are recorded; `parameters` are the ship's, where they are not those of the card.
  constructor(ship, data, signals = [...Voyage.MOTION, ...Voyage.driven(data).shown], most = undefined, parameters = {}) {
    Object.assign(this, { ship, signals, most, parameters });
    this.levers = data.thrusters.length > 0 ? new Levers(data.thrusters) : null;
    this.recorded = [...Voyage.driven(data).ordered, ...Voyage.WIND];
    this.step = data.step;
    this.longest = data.longest;
    this.read = ship.reader(signals);
    this.begin(data.start);
  }

  // What steers and drives: names of its orders, and of what answers them.
  static driven({ thrusters }) {
    if (thrusters.length === 0) return { ordered: ["rudder.command", "propeller.speed"], shown: ["rudder.angle"] };
    const ordered = thrusters.map((one) => one.name);
    return { ordered, shown: ordered.map((name) => name.replace("command", "speed")) };
  }

  begin(start, orders = {}) {
    this.ship.begin({ ...this.parameters, ...start, ...orders });
    this.time = 0;
    this.steps = 0;
    this.zigzag = null;
    this.programme = [];
    this.course = null; // rad, that the autopilot keeps
    this.orders = this.levers ? { ...orders } : { "rudder.command": 0, ...orders };
    this.record = new Record(["t", ...this.signals, ...this.recorded], this.most);
    this.begun = { ...this.orders };
    this.changes = []; // [t, name, value] of what no column holds
    this.#sample(true);
  }

  get samples() { return this.record.columns; }

  order(name, value) {
    this.ship.set(name, value);
    this.orders[name] = value;
    this.record.change(name, value);
    if (!this.recorded.includes(name)) this.changes.push([this.time, name, value]);
  }

  // The rudder (rad), or the difference of the revolutions of a craft's thrusters (rad/s); positive to starboard.
  turn(value) {
    if (!this.levers) return this.order("rudder.command", value);
    const orders = this.levers.orders({ mean: this.levers.read(this.orders).mean, difference: value });
    for (const [name, one] of Object.entries(orders)) this.order(name, one);
  }

  // Whether an input is what a zigzag orders.
  steers(name) { return this.levers ? this.levers.has(name) : name === "rudder.command"; }

  // The rudder is the hand's again, and the gear's. Returns what has ended: "zigzag", "programme", "autopilot" or null.
  release() {
    const ended = this.zigzag ? "zigzag" : this.programme.length > 0 ? "programme" : null;
    this.zigzag = null;
    this.programme = [];
    if (this.ship.has("ghost.steers")) this.ship.setTruth("ghost.steers", false);
    if (this.course === null) return ended;
    this.order("rudder.command", this.ship.get("autopilot.order")); // it stays where the autopilot has put it
    this.ship.setTruth("autopilot.steers", false);
    this.course = null;
    return "autopilot";
  }

  // The autopilot brings the ship to a course (rad), the short way, and keeps it.
  steer(course) {
    if (this.course === null) this.release();
    this.course = course;
    this.ship.set("heading.command", course);
    this.ship.setTruth("autopilot.steers", true);
    this.record.passing = false;
  }

  startZigzag(rudder, heading) {
    this.release();
    this.zigzag = new Zigzag(rudder, heading, this.ship.get("motion.psi"), this.time + this.longest,
      this.levers ? Math.PI / 30 : DEG);
    this.turn(this.zigzag.order);
  }

  // Orders [{t, name: value, ...}], each held until the next, from now on.
  follow(programme) {
    this.release();
    this.programme = programme.filter((one) => one.t >= this.time - 1e-9 * this.step);
    this.#obey();
  }

  // On to the next sample, at `until` (s) at the latest. Returns "zigzag" or "programme" if that has just ended, else
  // null.
  advance(until = Infinity) {
    const tolerance = 1e-9 * this.step;
    const onGrid = this.time <= this.steps * this.step + tolerance;
    const grid = (this.steps + 1) * this.step;
    const ordered = Math.min(this.programme[0]?.t ?? Infinity, until);
    const whole = ordered >= grid - tolerance;
    const size = whole ? (onGrid ? this.step : grid - this.time) : ordered - this.time;
    const before = this.time;
    if (this.zigzag) this.ship.keep();
    this.ship.step(before, size);
    if (this.zigzag?.beyond(this.ship.get("motion.psi")) >= 0) return this.#switch(before, size);
    this.time = whole ? grid : ordered;
    if (whole) this.steps += 1;
    this.#sample(!whole);
    if (this.zigzag && this.time >= this.zigzag.latest) return this.#ended("zigzag");
    return this.#obey();
  }

  // Where the ship comes to in `seconds` with its orders held: [{t, x, y, psi}, ...], `stride` s (whole steps) apart.
  ahead(seconds, stride) {
    const [from, every] = [this.time, Math.max(1, Math.round(stride / this.step))];
    const places = [];
    const note = (t) => {
      const [x, y, psi] = this.read();
      places.push({ t, x, y, psi });
    };
    note(from);
    this.ship.keep();
    try {
      const count = Math.ceil(seconds / this.step / every - 1e-9) * every;
      for (let [time, taken] = [from, 0]; taken < count;) {
        const next = (this.steps + taken + 1) * this.step;
        this.ship.step(time, taken === 0 && time > this.steps * this.step + 1e-9 * this.step ? next - time : this.step);
        [time, taken] = [next, taken + 1];
        if (taken % every === 0) note(time);
      }
    } finally {
      this.ship.back();
    }
    return places;
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
    this.#sample(true);
    if (this.zigzag.turn()) return this.#ended("zigzag");
    this.turn(this.zigzag.order);
    return null;
  }

  #obey() {
    const begun = this.programme.length > 0;
    while (this.programme[0]?.t <= this.time + 1e-9 * this.step) {
      const { t, ...orders } = this.programme.shift();
      for (const [name, value] of Object.entries(orders)) {
        if (typeof value === "boolean") this.ship.setTruth(name, value);
        else if (name.startsWith("ghost.")) this.ship.set(name, value);
        else this.order(name, value);
      }
    }
    if (!begun || this.programme.length > 0) return null;
    this.release();
    return "programme";
  }

  #ended(what) {
    this.done = this.zigzag;
    this.zigzag = null;
    return what;
  }

  #sample(kept) {
    const values = this.read();
    if (this.course !== null) this.orders["rudder.command"] = this.ship.get("autopilot.order");
    const row = [this.time, ...values, ...this.recorded.map((name) => this.orders[name] ?? 0)];
    this.record.add(row, !kept && this.steps % this.record.stride !== 0);
    this.zigzag?.watch(values[2]);
  }

  #ofThrusters(rpm) {
    const speeds = this.levers.names.map((name) => [`n_${name.split(".")[1]}_rpm`, [name.replace("command", "speed"), rpm]]);
    return { ...this.levers.shares(), ...Object.fromEntries(speeds) };
  }

  // The voyage as a trial file of tank2sim, with all digits; `comments` are its first lines.
  csv(comments) {
    const deg = (value) => value * 180 / Math.PI;
    const rpm = (value) => value * 30 / Math.PI;
    const [engine, wind] = ["propeller.speed" in this.orders, "wind.speed" in this.orders];
    const driven = this.levers ? this.#ofThrusters(rpm) : {
      delta_order_deg: ["rudder.command", deg], delta_deg: ["rudder.angle", deg],
      ...(engine ? { n_rpm: ["propeller.speed", rpm] } : {}),
    };
    const columns = {
      t_s: ["t", Number], ...driven, u_mps: ["motion.u", Number], v_mps: ["motion.v", Number],
      r_degps: ["motion.r", deg], psi_deg: ["motion.psi", deg], x_m: ["motion.x", Number], y_m: ["motion.y", Number],
      ...(wind ? { wind_speed_mps: ["wind.speed", Number], wind_direction_deg: ["wind.direction", deg] } : {}),
    };
    const rows = this.samples.t.map((_, row) =>
      Object.values(columns).map(([name, shown]) => shown(this.samples[name][row])).join(","));
    if (this.record.stride > 1) comments = [...comments, `samples of every ${this.record.stride} steps`];
    return [...comments.map((one) => `# ${one}`), Object.keys(columns).join(","), ...rows, ""].join("\n");
  }
}
