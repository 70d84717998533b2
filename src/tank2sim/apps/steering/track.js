// The chart, north up and to scale: waters, tracks, hulls at times, what is ahead, and the wind and current that act.

const FLOWS = [["current", "towards", 0], ["wind", "from", Math.PI]];

class TrackChart {
  static INTERVALS = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1200, 1800, 3600]; // s between hulls along the track
  static APART = 1.7; // drawn lengths between hulls along the track, at least
  static HULLS = 60; // most hulls along the track: the last
  static MEMBER_POINTS = 250; // of the track of a member

  constructor(canvas, data, view, waters = null) {
    Object.assign(this, { canvas, view, waters });
    Object.assign(this, { length: data.length, beam: data.beam, speed: data.speed, ghost: data.ghost });
    Object.assign(this, { speeds: data.speeds, outlines: data.outlines });
    this.forget();
  }

  // Bounds of what was sailed begin again, with the measured trial and the waters in view.
  forget() {
    this.seen = 0;
    this.bounds = { north: -Infinity, south: Infinity, east: -Infinity, west: Infinity };
    const { ghost } = this;
    if (ghost) ghost.x.forEach((x, row) => { if (x !== null && ghost.y[row] !== null) this.#take(x, ghost.y[row]); });
    for (const [x, y] of this.waters?.corners ?? []) this.#take(x, y);
  }

  #take(x, y) {
    const { bounds } = this;
    bounds.north = Math.max(bounds.north, x);
    bounds.south = Math.min(bounds.south, x);
    bounds.east = Math.max(bounds.east, y);
    bounds.west = Math.min(bounds.west, y);
  }

  // `own` is the voyage, `members` those whose tracks are shown, `ahead` the places that the ship comes to.
  draw(own, members, ahead, paper = false) {
    const { samples } = own;
    const [x, y] = [samples["motion.x"], samples["motion.y"]];
    for (let row = Math.min(this.seen, x.length - 1); row < x.length; row += 1) this.#take(x[row], y[row]);
    this.seen = x.length;
    const last = x.length - 1;
    const { pen, width, height } = prepared(this.canvas);
    const colour = colours(paper);
    const flows = this.#flows(pen, width, own.orders);
    const scene = this.#scene(pen, width, height, flows.high, [x[last], y[last]]);
    const { box, at } = scene;
    pen.save();
    pen.beginPath();
    pen.rect(box.left, box.top, box.across, box.up);
    pen.clip();
    this.waters?.areas(pen, colour, at);
    pen.restore();
    axes(pen, colour, box, scene.east, scene.north);
    pen.save();
    pen.beginPath();
    pen.rect(box.left, box.top, box.across, box.up);
    pen.clip();
    this.waters?.marks(pen, colour, at, scene.scale);
    if (this.ghost) this.#ghost(pen, colour, scene, own.time);
    for (const { aground, voyage } of members) {
      this.#member(pen, aground ? colour.port : colour.member, scene, voyage.samples);
    }
    line(pen, x.length, (row) => at(x[row], y[row]), { colour: colour.own, width: 2.4 });
    this.#hulls(pen, colour, scene, samples);
    this.#ahead(pen, colour, scene, ahead);
    this.#hull(pen, scene, x[last], y[last], samples["motion.psi"][last], { fill: colour.hull });
    pen.restore();
    for (const flow of flows.found) this.#flow(pen, colour, flow);
  }

  #hull(pen, { at, scale }, x, y, psi, look) { hull(pen, at(x, y), psi, this.length * scale, this.beam * scale, look); }

  #ghost(pen, colour, scene, time) {
    const { x, y, psi } = this.ghost;
    const at = (row) => (x[row] === null || y[row] === null ? null : scene.at(x[row], y[row]));
    line(pen, x.length, at, { colour: colour.other, dash: [7, 4], width: 1.8 });
    const row = this.#ghostRow(time);
    if (row >= 0 && at(row)) this.#hull(pen, scene, x[row], y[row], psi[row] ?? 0, { stroke: colour.other });
  }

  #ghostRow(time) {
    const after = this.ghost.t.findIndex((one) => one > time);
    return after < 0 ? this.ghost.t.length - 1 : after - 1;
  }

  #member(pen, colour, scene, samples) {
    const [x, y, psi] = Voyage.POSE.map((name) => samples[name]);
    const look = { colour, width: 1, alpha: 0.5, most: TrackChart.MEMBER_POINTS };
    line(pen, x.length, (row) => scene.at(x[row], y[row]), look);
    this.#hull(pen, scene, x.at(-1), y.at(-1), psi.at(-1), { stroke: colour, width: 1, alpha: 0.7 });
  }

  // Outlines along the track at round times, each with its time in minutes.
  #hulls(pen, colour, scene, samples) {
    const { t } = samples;
    const [x, y, psi] = Voyage.POSE.map((name) => samples[name]);
    const drawn = Math.max(this.length * scene.scale, LEAST_HULL);
    const enough = TrackChart.APART * drawn / (this.speed * scene.scale);
    const every = TrackChart.INTERVALS.find((one) => one >= enough) ?? Math.ceil(enough / 3600) * 3600;
    const count = Math.floor((t.at(-1) + 1e-6) / every);
    const written = []; // places of words, which others keep clear of
    Object.assign(pen, { fillStyle: colour.muted, textAlign: "left", textBaseline: "middle" });
    for (let number = Math.max(0, count - TrackChart.HULLS); number <= count; number += 1) {
      const row = Math.max(0, HistoryChart.place(t, number * every + 1e-6) - 1);
      this.#hull(pen, scene, x[row], y[row], psi[row], { stroke: colour.own, width: 1.2, alpha: 0.75 });
      const [left, top] = scene.at(x[row], y[row]);
      const [side, off] = [psi[row] + Math.PI / 2, this.beam * scene.scale / 2 + 12];
      const minutes = number * every / 60;
      if (number === 0 || drawn * TrackChart.APART < 34) continue; // no room for its words
      const words = Number.isInteger(minutes) ? `${minutes} min` : `${number * every} s`;
      const back = Math.sin(side) < -0.2 ? pen.measureText(words).width : 0;
      const [right, down] = [left + Math.sin(side) * off - back, top - Math.cos(side) * off];
      if (written.some(([x, y]) => Math.abs(x - right) < 48 && Math.abs(y - down) < 14)) continue;
      written.push([right, down]);
      pen.fillText(words, right, down);
    }
  }

  // The curve of what is ahead, with an outline every so often.
  #ahead(pen, colour, scene, ahead) {
    if (ahead.length < 2) return;
    const look = { colour: colour.ahead, width: 2.2, dash: [6, 4] };
    line(pen, ahead.length, (row) => scene.at(ahead[row].x, ahead[row].y), look);
    const [from, end] = [ahead[0].t, ahead.at(-1)];
    const every = this.outlines;
    let number = 1;
    for (const { t, x, y, psi } of ahead) {
      if (t < from + every * number - 1e-6) continue;
      number += 1;
      this.#hull(pen, scene, x, y, psi, { stroke: colour.ahead, width: t === end.t ? 2 : 1.2 });
    }
    Object.assign(pen, { fillStyle: colour.ahead, textAlign: "left", textBaseline: "middle" });
    const [left, top] = scene.at(end.x, end.y);
    const off = this.beam * scene.scale / 2 + 12;
    const [seconds, minutes] = [Math.round(end.t - from), Math.round((end.t - from) / 6) / 10];
    pen.fillText(`in ${seconds < 60 ? `${seconds} s` : `${label(minutes)} min`}`, left + off, top);
  }

  // Twice, for the room on the left follows from the labels, and they from the room. `above` is kept free.
  #scene(pen, width, height, above, ship) {
    const within = (values) => {
      const margin = margins(pen, values);
      return this.#sceneWithin({ ...margin, top: margin.top + above }, width, height, ship);
    };
    return within(within([-1000]).north.values);
  }

  #sceneWithin(margin, width, height, ship) {
    const box = { left: margin.left, top: margin.top };
    Object.assign(box, { across: width - margin.left - margin.right, up: height - margin.top - margin.bottom });
    const { centre: [x0, y0], scale } = this.view.within(box, ship, this.bounds);
    const [left, top] = [box.left + box.across / 2, box.top + box.up / 2];
    const at = (x, y) => [left + (y - y0) * scale, top - (x - x0) * scale];
    const [far, wide] = [box.up / 2 / scale, box.across / 2 / scale];
    return {
      scale, at, box,
      north: { values: ticks(x0 - far, x0 + far, box.up / 60), at: (x) => at(x, y0)[1], title: "x, north (m)" },
      east: { values: ticks(y0 - wide, y0 + wide, box.across / 75), at: (y) => at(x0, y)[0], title: "y, east (m)" },
    };
  }

  // Wind and current that act: words, and where they stand above the frame, from the right.
  #flows(pen, width, orders) {
    const found = [];
    let [right, top] = [width - 14, 4];
    for (const [name, word, turned] of FLOWS) {
      const [speed, direction] = [orders[`${name}.speed`], orders[`${name}.direction`]];
      if (!(speed > 0)) continue;
      const bearing = Math.round(((direction * 180 / Math.PI) % 360 + 360) % 360) % 360;
      const text = `${name} ${(speed * this.speeds.factor).toFixed(this.speeds.digits)} ${this.speeds.unit} ${word} ${bearing} deg`;
      const wide = pen.measureText(text).width + 34;
      if (right - wide < 0) [right, top] = [width - 14, top + 28];
      found.push({ text, left: right - wide, top, towards: direction + turned });
      right -= wide + 16;
    }
    return { found, high: found.length > 0 ? top + 20 : 0 };
  }

  // An arrow along which it goes, and its words.
  #flow(pen, colour, { text, left, top, towards }) {
    arrow(pen, left + 13, top + 13, towards, colour.own);
    Object.assign(pen, { fillStyle: colour.ink, textAlign: "left", textBaseline: "middle" });
    pen.fillText(text, left + 34, top + 14);
  }
}
