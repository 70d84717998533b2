// The score of an attempt in the waters of a scenario: off the centre line, buoys hit, aground, time.

class Score {
  // Points lost of 100 (project choices): the root mean square of the distance off the centre line over half the width
  // of the channel, a buoy, a minute out of the channel, and the time beyond that of the channel at the first speed.
  static OFF = 40;
  static BUOY = 10;
  static OUT = 5;
  static LATE = 20;
  static MEMBERS_EVERY = 5; // s between looks at whether a member is aground

  constructor(waters, data) {
    Object.assign(this, { waters, speed: data.speed });
    this.begin(data.speed);
  }

  // At the start, where the ship goes `speed` (m/s).
  begin(speed) {
    Object.assign(this, { time: 0, squares: 0, counted: 0, most: 0, out: 0, aground: null, arrived: null });
    this.buoys = new Set();
    this.looked = 0;
    this.par = this.#length() / Math.max(speed, 0.1);
  }

  #length() {
    const points = this.waters.channel?.points ?? [];
    return points.slice(1).reduce((sum, [x, y], row) => sum + Math.hypot(x - points[row][0], y - points[row][1]), 0);
  }

  get over() { return this.aground !== null || this.arrived !== null; }

  // One sample of the ship. Returns "aground", "arrived" or null.
  take(time, x, y, psi, speed) {
    if (this.over) return null;
    const step = time - this.time;
    this.time = time;
    for (const buoy of this.waters.touched(x, y, psi)) this.buoys.add(buoy);
    const found = this.waters.offCentre(x, y);
    if (found) {
      this.squares += step * found.off ** 2;
      this.counted += step;
      this.most = Math.max(this.most, Math.abs(found.off));
      if (Math.abs(found.off) > this.waters.channel.width_m / 2) this.out += step;
    }
    const held = this.waters.aground(x, y, psi);
    if (held) { this.aground = { by: held, time }; return "aground"; }
    if (this.waters.arrived(x, y, psi, speed)) { this.arrived = { time }; return "arrived"; }
    return null;
  }

  // Which of the members are aground: looked at now and then, for it takes long.
  look(time, members) {
    if (time < this.looked + Score.MEMBERS_EVERY) return;
    this.looked = time;
    for (const member of members) {
      if (member.aground || member.lost) continue;
      const [x, y, psi] = Voyage.POSE.map((name) => member.voyage.samples[name].at(-1));
      member.aground = this.waters.aground(x, y, psi) !== null;
    }
  }

  get rms() { return this.counted > 0 ? Math.sqrt(this.squares / this.counted) : 0; }

  // Points so far, 0 to 100.
  get points() {
    if (this.aground) return 0;
    const half = (this.waters.channel?.width_m ?? Infinity) / 2;
    const late = this.par > 0 ? Math.max(0, this.time / this.par - 1) : 0;
    const lost = Score.OFF * Math.min(1, this.rms / half) + Score.BUOY * this.buoys.size +
      Score.OUT * this.out / 60 + Score.LATE * Math.min(1, late);
    return Math.max(0, 100 - lost);
  }
}
