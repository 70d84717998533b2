// The helm: every order goes to the ship and to all members, and into the attempt.

// A ship that the measurements cannot exclude, with what is drawn of its voyage.
class Member {
  static MOST = 4000; // rows of a member's track: more than a screen is wide

  constructor(ship, data, parameters) {
    this.voyage = new Voyage(ship, data, Voyage.POSE, Member.MOST, parameters);
    this.lost = false; // its motion left all bounds
    this.aground = false; // in a scenario: it has touched, and sails on here as if it had not
  }

  // Does this with the voyage, unless the member is lost; one whose motion leaves all bounds is lost from then on.
  try(what) {
    if (this.lost) return;
    try { what(this.voyage); } catch { this.lost = true; }
  }

  catchUp(time) {
    this.try((voyage) => { while (voyage.time < time - 1e-9 * voyage.step) voyage.advance(time); });
  }
}

class Helm {
  constructor(ship, data) {
    this.own = new Voyage(ship, data);
    this.members = data.members.map((parameters) => new Member(ship.another(), data, parameters));
    this.programmeOf = () => []; // orders of the measured trial; the page knows them
    this.attempt = new Attempt();
    this.replayed = null;
    this.score = data.scenario ? new Score(new Waters(data.scenario, data), data) : null;
  }

  get time() { return this.own.time; }

  get sailing() { return this.members.filter((member) => !member.lost); }

  // At the start again, with these values and inputs (SI, by name); `attempt` is to be replayed.
  begin(start, orders, attempt = null) {
    this.own.begin(start, orders);
    for (const member of this.members) {
      member.lost = member.aground = false;
      member.try((voyage) => voyage.begin(start, orders));
    }
    this.score?.begin(this.own.ship.get("motion.u"));
    this.attempt = new Attempt(start, orders);
    this.replayed = attempt ? { events: [...attempt.events], end: attempt.end } : null;
    this.#replay();
  }

  // The orders. Each is kept with its time, and returns what it has ended.
  order(name, value) {
    let ended = null;
    this.#all("o", [name, value], (voyage) => {
      const left = voyage.steers(name) ? voyage.release() : null; // a member's zigzag may last longer
      if (voyage === this.own) ended = left;
      voyage.order(name, value);
    });
    return ended;
  }

  steer(course) { this.#all("c", [course], (voyage) => voyage.steer(course)); }

  release() {
    const ended = this.own.course !== null || this.own.zigzag || this.own.programme.length > 0;
    if (ended) this.#all("h", [], (voyage) => voyage.release());
  }

  zigzag(rudder, heading) { this.#all("z", [rudder, heading], (voyage) => voyage.startZigzag(rudder, heading)); }

  follow() { this.#all("f", [], (voyage) => voyage.follow(this.programmeOf())); }

  fail(truth) { this.#all("x", [truth ? 1 : 0], (voyage) => voyage.ship.setTruth("steering.failed", truth)); }

  #all(code, values, what) {
    this.attempt.note(this.time, code, values);
    what(this.own);
    for (const member of this.members) member.try(what);
  }

  // On to the next sample of the ship, and the members after it. Returns what has ended: as the voyage or the score, or
  // "replay".
  advance() {
    const ended = this.own.advance();
    for (const member of this.members) member.catchUp(this.own.time);
    this.attempt.end = this.own.time;
    const judged = this.#judge();
    if (!this.replayed) return judged ?? ended;
    this.#replay();
    return this.replayed ? judged : judged ?? "replay";
  }

  #judge() {
    if (!this.score) return null;
    const [x, y, psi, u, v] = Voyage.MOTION.map((name) => this.own.samples[name].at(-1));
    this.score.look(this.time, this.members);
    return this.score.take(this.time, x, y, psi, Math.hypot(u, v));
  }

  // The orders of the replayed attempt that are due now. Times are those of the same samples, to the last digit.
  #replay() {
    if (!this.replayed) return;
    const { events, end } = this.replayed;
    const does = {
      o: (name, value) => this.order(name, value), c: (course) => this.steer(course), h: () => this.release(),
      z: (rudder, heading) => this.zigzag(rudder, heading), f: () => this.follow(),
      x: (truth) => this.fail(truth === 1),
    };
    while (events[0]?.t <= this.time) {
      const { code, values } = events.shift();
      does[code](...values);
    }
    if (this.time >= end) this.replayed = null;
  }
}
