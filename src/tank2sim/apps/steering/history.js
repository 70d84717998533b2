// Change of heading (within 180 deg either way) and rudder, deg, over the last minutes.

class HistoryChart {
  static LEAST = 30; // deg either way that the axis shows at least: most rudders and headings of trials

  constructor(canvas, data, stretch) {
    Object.assign(this, { canvas, ghost: data.ghost, thrusters: data.thrusters, stretch });
  }

  draw(samples, paper = false) {
    const { pen, width, height } = prepared(this.canvas);
    const colour = colours(paper);
    const span = this.#span(samples.t.at(-1));
    const lines = this.#lines(samples, colour, span);
    const [low, high] = this.#range(lines);
    const marks = (up) => ticks(low, high, up / 34, ANGLES);
    const margin = margins(pen, marks(height));
    const box = { ...margin, across: width - margin.left - margin.right, up: height - margin.top - margin.bottom };
    const across = (time) => box.left + (time - span.begin) / (span.end - span.begin) * box.across;
    const up = (value) => box.top + (high - value) / (high - low) * box.up;
    const times = ticks(span.begin, span.end, box.across / 90);
    axes(pen, colour, box, { values: times, at: across, title: "t (s)" },
      { values: marks(box.up), at: up, title: this.thrusters.length > 0 ? "deg, %" : "angle (deg)" });
    pen.save();
    pen.beginPath();
    pen.rect(box.left, box.top, box.across, box.up);
    pen.clip();
    for (const { count, time, value, look } of lines) {
      let before = null;
      line(pen, count, (row) => {
        const [t, angle] = [time(row), value(row)];
        if (angle === null) return null;
        const jumped = before !== null && Math.abs(angle - before) > 180; // from one end of the axis to the other
        before = angle;
        return [across(t), up(angle), jumped];
      }, look);
    }
    pen.restore();
  }

  #span(now) {
    const end = Math.max(now, this.stretch);
    return { begin: end - this.stretch, end };
  }

  // What is drawn within a span of time, with one reading more at its beginning.
  #lines(samples, colour, { begin, end }) {
    const from = (t) => Math.max(0, HistoryChart.place(t, begin) - 1);
    const made = (t, value, look) => {
      const first = from(t);
      const count = Math.min(t.length, HistoryChart.place(t, end) + 1) - first;
      return { count, time: (row) => t[first + row], value: (row) => value(first + row), look };
    };
    const deg = (values) => (row) => (values[row] === null ? null : values[row] * 180 / Math.PI);
    const changed = (values) => {
      const course = values.find((one) => one !== null) ?? 0;
      return (row) => (values[row] === null ? null : HistoryChart.wrapped(values[row] - course));
    };
    const dash = [3, 3];
    const found = [];
    if (this.ghost) {
      const { t, psi, rudder } = this.ghost;
      found.push(made(t, deg(rudder), { colour: colour.other, dash, width: 1.4 }));
      found.push(made(t, changed(psi), { colour: colour.other, width: 1.6 }));
    }
    const { t } = samples;
    found.push(made(t, this.#steering(samples, deg), { colour: colour.own, dash, width: 1.6 }));
    found.push(made(t, changed(samples["motion.psi"]), { colour: colour.own, width: 2.2 }));
    return found;
  }

  // The rudder (deg), or the difference of a craft's revolutions in % of the largest that it can be.
  #steering(samples, deg) {
    if (this.thrusters.length === 0) return deg(samples["rudder.angle"]);
    const levers = new Levers(this.thrusters);
    const most = levers.high - levers.low;
    const at = (row) => ([name]) => [name, samples[name.replace("command", "speed")][row]];
    const now = (row) => Object.fromEntries(levers.names.map((name) => at(row)([name])));
    return (row) => 100 * levers.read(now(row)).difference / most;
  }

  #range(lines) {
    let [low, high] = [-HistoryChart.LEAST, HistoryChart.LEAST];
    for (const { count, value } of lines) {
      const stride = Math.max(1, Math.ceil(count / MOST_POINTS));
      for (let row = 0; row < count; row += stride) {
        const angle = value(row) ?? 0;
        low = Math.min(low, angle);
        high = Math.max(high, angle);
      }
    }
    const room = 0.06 * (high - low);
    return [low - room, high + room];
  }

  // Row of the first time after `wanted`, of times that rise.
  static place(times, wanted) {
    let [low, high] = [0, times.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] <= wanted) low = middle + 1; else high = middle;
    }
    return low;
  }

  // An angle (rad) in deg, from -180 to 180.
  static wrapped(angle) {
    const turned = angle * 180 / Math.PI;
    return turned - 360 * Math.round(turned / 360);
  }
}
