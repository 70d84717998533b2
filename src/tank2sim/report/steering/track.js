// The track, north up and to scale, with the ghost and the wind and current that act.

const FLOWS = [["current", "towards", 0], ["wind", "from", Math.PI]];

class TrackChart {
  constructor(canvas, data) {
    Object.assign(this, { canvas, length: data.length, beam: data.beam, ghost: data.ghost });
    this.forget();
  }

  // Bounds of what was sailed begin again, with the ghost in view.
  forget() {
    this.seen = 0;
    this.bounds = { north: -Infinity, south: Infinity, east: -Infinity, west: Infinity };
    const { ghost } = this;
    if (ghost) ghost.x.forEach((x, row) => { if (x !== null && ghost.y[row] !== null) this.#take(x, ghost.y[row]); });
  }

  #take(x, y) {
    const { bounds } = this;
    bounds.north = Math.max(bounds.north, x);
    bounds.south = Math.min(bounds.south, x);
    bounds.east = Math.max(bounds.east, y);
    bounds.west = Math.min(bounds.west, y);
  }

  // `orders` are the inputs that act now, SI, by name.
  draw(samples, ghostTime, orders, paper = false) {
    const [x, y] = [samples["motion.x"], samples["motion.y"]];
    for (let row = Math.min(this.seen, x.length - 1); row < x.length; row += 1) this.#take(x[row], y[row]);
    this.seen = x.length;
    const { pen, width, height } = prepared(this.canvas);
    const colour = colours(paper);
    const flows = this.#flows(pen, width, orders);
    const view = this.#view(pen, width, height, flows.high);
    axes(pen, colour, view.box, view.east, view.north);
    pen.save();
    pen.beginPath();
    pen.rect(view.box.left, view.box.top, view.box.across, view.box.up);
    pen.clip();
    if (this.ghost) this.#ghost(pen, colour, view, ghostTime);
    line(pen, x.length, (row) => view.at(x[row], y[row]), { colour: colour.own, width: 2.4 });
    const last = x.length - 1;
    this.#hull(pen, view.at(x[last], y[last]), samples["motion.psi"][last], view.scale, { fill: colour.hull });
    pen.restore();
    for (const flow of flows.found) this.#flow(pen, colour, flow);
  }

  #ghost(pen, colour, view, time) {
    const { x, y, psi } = this.ghost;
    const at = (row) => (x[row] === null || y[row] === null ? null : view.at(x[row], y[row]));
    line(pen, x.length, at, { colour: colour.other, dash: [7, 4], width: 1.8 });
    const row = this.#ghostRow(time);
    if (row >= 0 && at(row)) this.#hull(pen, at(row), psi[row] ?? 0, view.scale, { stroke: colour.other });
  }

  #ghostRow(time) {
    const after = this.ghost.t.findIndex((one) => one > time);
    return after < 0 ? this.ghost.t.length - 1 : after - 1;
  }

  // Twice, for the room on the left follows from the labels, and they from the room. `above` is kept free.
  #view(pen, width, height, above) {
    const within = (values) => {
      const margin = margins(pen, values);
      return this.#viewWithin({ ...margin, top: margin.top + above }, width, height);
    };
    return within(within([-1000]).north.values);
  }

  #viewWithin(margin, width, height) {
    const { north, south, east, west } = this.bounds;
    const [across, up] = [width - margin.left - margin.right, height - margin.top - margin.bottom];
    const least = 8 * this.length;
    const shown = (span) => Math.max(least, span * 1.16);
    const scale = Math.min(across / shown(east - west), up / shown(north - south));
    const [x0, y0] = [(north + south) / 2, (east + west) / 2];
    const [left, top] = [margin.left + across / 2, margin.top + up / 2];
    const at = (x, y) => [left + (y - y0) * scale, top - (x - x0) * scale];
    const [far, wide] = [up / 2 / scale, across / 2 / scale];
    return {
      scale, at, box: { left: margin.left, top: margin.top, across, up },
      north: { values: ticks(x0 - far, x0 + far, up / 60), at: (x) => at(x, y0)[1], title: "x, north (m)" },
      east: { values: ticks(y0 - wide, y0 + wide, across / 75), at: (y) => at(x0, y)[0], title: "y, east (m)" },
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
      const text = `${name} ${(speed * 3600 / 1852).toFixed(1)} knots ${word} ${bearing} deg`;
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

  // A ship seen from above, to scale, but never too small to see.
  #hull(pen, [left, top], psi, scale, look) {
    const long = Math.max(this.length * scale, 22);
    const half = Math.max(this.beam * scale, long / 7) / 2;
    pen.save();
    pen.translate(left, top);
    pen.rotate(psi);
    pen.beginPath();
    pen.moveTo(0, -long / 2);
    pen.quadraticCurveTo(half, -long / 3, half, -long / 6);
    pen.lineTo(half, long / 2);
    pen.lineTo(-half, long / 2);
    pen.lineTo(-half, -long / 6);
    pen.quadraticCurveTo(-half, -long / 3, 0, -long / 2);
    pen.closePath();
    if (look.fill) { pen.fillStyle = look.fill; pen.fill(); }
    if (look.stroke) { pen.strokeStyle = look.stroke; pen.lineWidth = 1.8; pen.stroke(); }
    pen.restore();
  }
}
