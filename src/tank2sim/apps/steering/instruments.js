// Heading tape, and dials of the rate of turn and the rudder. Port is left and red, starboard right and green.

class HeadingTape {
  static SHOWN = 40; // deg either way of the heading

  constructor(canvas) { this.canvas = canvas; }

  // `heading` and `course` (null without an autopilot) in deg.
  draw(heading, course, paper) {
    const { pen, width, height } = prepared(this.canvas);
    const colour = colours(paper);
    const [middle, scale, base] = [width / 2, width / 2 / HeadingTape.SHOWN, height - 13];
    Object.assign(pen, { strokeStyle: colour.muted, fillStyle: colour.ink, lineWidth: 1.2 });
    Object.assign(pen, { textAlign: "center", textBaseline: "alphabetic" });
    const [first, last] = [Math.ceil((heading - HeadingTape.SHOWN) / 5), Math.floor((heading + HeadingTape.SHOWN) / 5)];
    for (let mark = first; mark <= last; mark += 1) {
      const [left, whole] = [middle + (5 * mark - heading) * scale, mark % 2 === 0];
      pen.strokeRect(left, base - (whole ? 11 : 6), 0, whole ? 11 : 6);
      if (whole) pen.fillText(String((5 * mark % 360 + 360) % 360).padStart(3, "0"), left, base - 17);
    }
    pen.strokeStyle = colour.frame;
    pen.strokeRect(0, base + 0.5, width, 0);
    if (course !== null) {
      const off = HistoryChart.wrapped((course - heading) * DEG);
      const left = Math.max(7, Math.min(width - 7, middle + off * scale)); // at the end of the tape if beyond it
      this.#mark(pen, left, base + 2, colour.ahead, -1);
    }
    this.#mark(pen, middle, 10, colour.own, 1);
    pen.fillRect(middle - 1, 10, 2, base - 10);
  }

  // A triangle with its point at (left, top), from above (1) or below (-1).
  #mark(pen, left, top, colour, side) {
    pen.fillStyle = colour;
    pen.beginPath();
    pen.moveTo(left, top);
    pen.lineTo(left - 6, top - 9 * side);
    pen.lineTo(left + 6, top - 9 * side);
    pen.closePath();
    pen.fill();
  }
}

class Dial {
  static SWEEP = Math.PI / 4; // rad either way of the top

  // From -`most` to `most`, which grows by the next of `larger` when it is passed.
  constructor(canvas, most, larger = []) { Object.assign(this, { canvas, most, larger }); }

  // `order` (null without) is marked on the rim.
  draw(value, order, paper) {
    while (Math.abs(value) > this.most && this.larger.some((one) => one > this.most)) {
      this.most = this.larger.find((one) => one > this.most);
    }
    const { pen, width, height } = prepared(this.canvas);
    if (height <= 42 || width <= 32) return; // hidden, as on paper
    const colour = colours(paper);
    const radius = Math.min((height - 42) / (1 - Math.cos(Dial.SWEEP)), (width / 2 - 16) / Math.sin(Dial.SWEEP));
    const [middle, base] = [width / 2, 13 + radius];
    const turned = (one) => Math.max(-1, Math.min(1, one / this.most)) * Dial.SWEEP;
    const rim = (angle, far) => [middle + Math.sin(angle) * far, base - Math.cos(angle) * far];
    const arc = (from, to, look, thick) => {
      Object.assign(pen, { strokeStyle: look, lineWidth: thick });
      pen.beginPath();
      pen.arc(middle, base, radius - 3, Math.min(from, to) - Math.PI / 2, Math.max(from, to) - Math.PI / 2);
      pen.stroke();
    };
    arc(-Dial.SWEEP, Dial.SWEEP, colour.grid, 6);
    arc(0, turned(value), value < 0 ? colour.port : colour.starboard, 6);
    Object.assign(pen, { strokeStyle: colour.muted, fillStyle: colour.muted, lineWidth: 1.2 });
    Object.assign(pen, { textAlign: "center", textBaseline: "middle" });
    for (const mark of ticks(-this.most, this.most, 7)) {
      const angle = turned(mark);
      pen.beginPath();
      pen.moveTo(...rim(angle, radius - 9));
      pen.lineTo(...rim(angle, radius - 14));
      pen.stroke();
      if (mark !== 0) pen.fillText(label(Math.abs(mark)), ...rim(angle, radius - 23));
    }
    this.#needle(pen, rim, turned(value), radius, colour.hull);
    if (order !== null) this.#order(pen, rim, turned(order), radius, colour.ahead);
  }

  #needle(pen, rim, angle, radius, colour) {
    Object.assign(pen, { strokeStyle: colour, lineWidth: 2.5 });
    pen.beginPath();
    pen.moveTo(...rim(angle, radius - 30));
    pen.lineTo(...rim(angle, radius - 1));
    pen.stroke();
  }

  #order(pen, rim, angle, radius, colour) {
    pen.fillStyle = colour;
    pen.beginPath();
    pen.moveTo(...rim(angle, radius));
    pen.lineTo(...rim(angle - 5 / radius, radius + 9));
    pen.lineTo(...rim(angle + 5 / radius, radius + 9));
    pen.closePath();
    pen.fill();
  }
}
