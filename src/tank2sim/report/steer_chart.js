"use strict";
// The charts on which one steers: the track, north up, and heading and rudder over time; drawn anew as she goes.

const colours = (paper) => {
  const light = { ink: "#16212c", muted: "#52606d", grid: "#e4e9ee", own: "#0072B2", other: "#D55E00", hull: "#16212c" };
  const dark = { ink: "#e8edf2", muted: "#a3b0bd", grid: "#27313b", own: "#56B4E9", other: "#E69F00", hull: "#e8edf2" };
  return !paper && matchMedia("(prefers-color-scheme: dark)").matches ? dark : light;
};
const FONT = "12px system-ui, -apple-system, 'Segoe UI', Roboto, 'Liberation Sans', Arial, sans-serif";
const MOST_POINTS = 3000; // of a line: more than a screen is wide

function ticks(low, high, about) {
  const raw = (high - low) / about;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((one) => one * power).find((one) => one >= raw);
  const found = [];
  for (let value = Math.ceil(low / step) * step; value <= high + 1e-9 * step; value += step) found.push(value);
  return found;
}

function label(value) {
  return String(Math.round(value * 1e6) / 1e6).replace("-", "\u2212").replace(/\B(?=(\d{3})+$)/g, "\u202f");
}

// The canvas at the resolution of the screen; what is drawn counts in CSS pixels.
function prepared(canvas) {
  const ratio = Math.max(1, window.devicePixelRatio || 1);
  const { clientWidth: width, clientHeight: height } = canvas;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = FONT;
  pen.lineJoin = "round";
  return { pen, width, height };
}

// A line through (xs, ys); a gap where something is missing.
function line(pen, count, place, look) {
  const stride = Math.max(1, Math.ceil(count / MOST_POINTS));
  pen.save();
  Object.assign(pen, { strokeStyle: look.colour, lineWidth: look.width ?? 2 });
  pen.setLineDash(look.dash ?? []);
  pen.beginPath();
  let down = false;
  for (let row = 0; row < count; row = row < count - 1 ? Math.min(row + stride, count - 1) : count) {
    const point = place(row);
    if (point === null) { down = false; continue; }
    if (down) pen.lineTo(...point); else pen.moveTo(...point);
    down = true;
  }
  pen.stroke();
  pen.restore();
}

class TrackChart {
  constructor(canvas, data) {
    Object.assign(this, { canvas, length: data.length, beam: data.beam, ghost: data.ghost });
    this.forget();
  }

  // Bounds of what was sailed begin anew, with the ghost in view.
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

  draw(samples, ghostTime, paper = false) {
    const [x, y] = [samples["motion.x"], samples["motion.y"]];
    for (; this.seen < x.length; this.seen += 1) this.#take(x[this.seen], y[this.seen]);
    const { pen, width, height } = prepared(this.canvas);
    const colour = colours(paper);
    const view = this.#view(width, height);
    this.#grid(pen, colour, view, width, height);
    if (this.ghost) {
      const { x: north, y: east, psi } = this.ghost;
      const at = (row) => (north[row] === null || east[row] === null ? null : view.at(north[row], east[row]));
      line(pen, north.length, at, { colour: colour.other, dash: [7, 4], width: 1.8 });
      const row = this.ghostRow(ghostTime);
      if (row >= 0 && at(row)) this.#hull(pen, at(row), psi[row] ?? 0, view.scale, { stroke: colour.other });
    }
    line(pen, x.length, (row) => view.at(x[row], y[row]), { colour: colour.own, width: 2.2 });
    const last = x.length - 1;
    this.#hull(pen, view.at(x[last], y[last]), samples["motion.psi"][last], view.scale, { fill: colour.hull });
  }

  ghostRow(time) {
    const after = this.ghost.t.findIndex((one) => one > time);
    return after < 0 ? this.ghost.t.length - 1 : after - 1;
  }

  #view(width, height) {
    const { north, south, east, west } = this.bounds;
    const margin = { left: 56, right: 14, top: 14, bottom: 40 };
    const [across, up] = [width - margin.left - margin.right, height - margin.top - margin.bottom];
    const least = 8 * this.length;
    const scale = Math.min(across / Math.max(least, (east - west) * 1.12), up / Math.max(least, (north - south) * 1.12));
    const [x0, y0] = [(north + south) / 2, (east + west) / 2];
    const [left, top] = [margin.left + across / 2, margin.top + up / 2];
    return { scale, margin, across, up, x0, y0, at: (x, y) => [left + (y - y0) * scale, top - (x - x0) * scale] };
  }

  #grid(pen, colour, view, width, height) {
    const { margin, across, up, scale, x0, y0 } = view;
    const right = margin.left + across;
    const bottom = margin.top + up;
    Object.assign(pen, { strokeStyle: colour.grid, fillStyle: colour.muted, lineWidth: 1 });
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (const x of ticks(x0 - up / 2 / scale, x0 + up / 2 / scale, up / 70)) {
      const [, place] = view.at(x, y0);
      pen.strokeRect(margin.left, place, across, 0);
      pen.fillText(label(x), margin.left - 6, place);
    }
    pen.textAlign = "center";
    pen.textBaseline = "top";
    for (const y of ticks(y0 - across / 2 / scale, y0 + across / 2 / scale, across / 90)) {
      const [place] = view.at(x0, y);
      pen.strokeRect(place, margin.top, 0, up);
      pen.fillText(label(y), place, bottom + 5);
    }
    pen.fillStyle = colour.ink;
    pen.fillText("y, east (m)", margin.left + across / 2, height - 15);
    pen.save();
    pen.translate(11, margin.top + up / 2);
    pen.rotate(-Math.PI / 2);
    pen.textBaseline = "middle";
    pen.fillText("x, north (m)", 0, 0);
    pen.restore();
    pen.beginPath();
    pen.rect(margin.left, margin.top, right - margin.left, up);
    pen.stroke();
  }

  // A ship seen from above, to scale, but never too small to see.
  #hull(pen, [left, top], psi, scale, look) {
    const long = Math.max(this.length * scale, 18);
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

// Heading change and rudder (deg) over the last minutes.
class HistoryChart {
  constructor(canvas, data) {
    Object.assign(this, { canvas, ghost: data.ghost, window: data.window });
  }

  draw(samples, paper = false) {
    const { pen, width, height } = prepared(this.canvas);
    const colour = colours(paper);
    const { t } = samples;
    const end = Math.max(t.at(-1), this.window);
    const begin = Math.max(0, end - 2 * this.window);
    let first = 0;
    if (begin > 0) first = t.findIndex((one) => one >= begin);
    const deg = 180 / Math.PI;
    const course = samples["motion.psi"][0];
    const own = {
      psi: (row) => (samples["motion.psi"][row] - course) * deg,
      rudder: (row) => samples["rudder.angle"][row] * deg,
    };
    let [low, high] = [-30, 30];
    const stride = Math.max(1, Math.ceil((t.length - first) / MOST_POINTS));
    for (let row = first; row < t.length; row += stride) {
      low = Math.min(low, own.psi(row), own.rudder(row));
      high = Math.max(high, own.psi(row), own.rudder(row));
    }
    const margin = { left: 56, right: 14, top: 12, bottom: 40 };
    const [across, up] = [width - margin.left - margin.right, height - margin.top - margin.bottom];
    [low, high] = [low - 0.05 * (high - low), high + 0.05 * (high - low)];
    const at = (time, value) =>
      [margin.left + (time - begin) / (end - begin) * across, margin.top + (high - value) / (high - low) * up];
    this.#grid(pen, colour, { margin, across, up, at, begin, end, low, high }, height);
    pen.save();
    pen.beginPath();
    pen.rect(margin.left, margin.top, across, up);
    pen.clip();
    if (this.ghost) this.#ghost(pen, colour, at, deg);
    const rows = t.length - first;
    const step = { colour: colour.own, dash: [2, 2], width: 1.6 };
    line(pen, rows, (row) => at(t[first + row], own.rudder(first + row)), step);
    line(pen, rows, (row) => at(t[first + row], own.psi(first + row)), { colour: colour.own });
    pen.restore();
  }

  #ghost(pen, colour, at, deg) {
    const { t, psi, rudder } = this.ghost;
    const course = psi.find((one) => one !== null) ?? 0;
    const look = { colour: colour.other, width: 1.5 };
    line(pen, t.length, (row) => (psi[row] === null ? null : at(t[row], (psi[row] - course) * deg)), look);
    const dotted = { ...look, dash: [2, 2] };
    line(pen, t.length, (row) => (rudder[row] === null ? null : at(t[row], rudder[row] * deg)), dotted);
  }

  #grid(pen, colour, { margin, across, up, at, begin, end, low, high }, height) {
    Object.assign(pen, { strokeStyle: colour.grid, fillStyle: colour.muted, lineWidth: 1 });
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (const value of ticks(low, high, up / 45)) {
      const [, place] = at(begin, value);
      pen.strokeRect(margin.left, place, across, 0);
      pen.fillText(label(value), margin.left - 6, place);
    }
    pen.textAlign = "center";
    pen.textBaseline = "top";
    for (const time of ticks(begin, end, across / 90)) {
      const [place] = at(time, 0);
      pen.strokeRect(place, margin.top, 0, up);
      pen.fillText(label(time), place, margin.top + up + 5);
    }
    pen.fillStyle = colour.ink;
    pen.fillText("t (s)", margin.left + across / 2, height - 15);
    pen.save();
    pen.translate(11, margin.top + up / 2);
    pen.rotate(-Math.PI / 2);
    pen.textBaseline = "middle";
    pen.fillText("angle (deg)", 0, 0);
    pen.restore();
  }
}
