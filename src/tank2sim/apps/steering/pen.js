// What the charts are drawn with: colours, axes, lines, hulls.

const colours = (paper) => {
  const light = { ink: "#16212c", muted: "#52606d", grid: "#e4e9ee", frame: "#aebac5", own: "#0072B2", other: "#D55E00",
    hull: "#16212c", paper: "#ffffff", ahead: "#00795a", member: "#52606d", port: "#d4372c", starboard: "#1b9a63",
    deep: "#eaf3fb", little: "#cfe3f3", shoal: "#b9d3b0", land: "#ecdcae" };
  const dark = { ink: "#e8edf2", muted: "#a3b0bd", grid: "#27313b", frame: "#4a5865", own: "#56B4E9", other: "#E69F00",
    hull: "#e8edf2", paper: "#151c23", ahead: "#5fd3ab", member: "#a3b0bd", port: "#ff7b70", starboard: "#4cc38a",
    deep: "#15222d", little: "#1b3447", shoal: "#2f4a3a", land: "#4a4129" };
  return !paper && matchMedia("(prefers-color-scheme: dark)").matches ? dark : light;
};
const FONT = "12px system-ui, -apple-system, 'Segoe UI', Roboto, 'Liberation Sans', Arial, sans-serif";
const MOST_POINTS = 3000; // of a line: more than a screen is wide
const ROUND = [1, 2, 5, 10]; // steps of an axis, times a power of ten
const ANGLES = [1, 2, 5, 10, 15, 30, 45, 60, 90, 180]; // steps of an axis of angles, deg

function ticks(low, high, about, steps) {
  const raw = (high - low) / Math.max(1, about);
  const power = 10 ** Math.floor(Math.log10(raw));
  const choices = steps ?? ROUND.map((one) => one * power);
  const step = choices.find((one) => one >= raw) ?? choices.at(-1);
  const found = [];
  for (let value = Math.ceil(low / step - 1e-9) * step; value <= high + 1e-9 * step; value += step) found.push(value);
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

// Room between the edge and the frame; on the left for the title and the widest label next to it.
function margins(pen, values) {
  const widest = Math.max(0, ...values.map((one) => pen.measureText(label(one)).width));
  return { left: Math.ceil(widest) + 32, right: 14, top: 12, bottom: 38 };
}

// Grid, labels and titles of a chart. `box` is {left, top, across, up}; `across` and `up` hold {values, at, title}.
function axes(pen, colour, box, across, up) {
  const [right, bottom] = [box.left + box.across, box.top + box.up];
  Object.assign(pen, { strokeStyle: colour.grid, fillStyle: colour.muted, lineWidth: 1 });
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  for (const value of up.values) {
    const place = Math.round(up.at(value)) + 0.5;
    pen.strokeRect(box.left, place, box.across, 0);
    pen.fillText(label(value), box.left - 7, place);
  }
  pen.textAlign = "center";
  pen.textBaseline = "top";
  for (const value of across.values) {
    const place = Math.round(across.at(value)) + 0.5;
    pen.strokeRect(place, box.top, 0, box.up);
    const half = pen.measureText(label(value)).width / 2;
    pen.fillText(label(value), Math.min(place, right + 12 - half), bottom + 6);
  }
  pen.fillStyle = colour.ink;
  pen.fillText(across.title, box.left + box.across / 2, bottom + 22);
  pen.save();
  pen.translate(10, box.top + box.up / 2);
  pen.rotate(-Math.PI / 2);
  pen.textBaseline = "middle";
  pen.fillText(up.title, 0, 0);
  pen.restore();
  pen.strokeStyle = colour.frame;
  pen.strokeRect(box.left + 0.5, box.top + 0.5, box.across, box.up);
}

// A line through the points place(0) ... place(count - 1); a gap where one is null.
function line(pen, count, place, look) {
  const stride = Math.max(1, Math.ceil(count / (look.most ?? MOST_POINTS)));
  pen.save();
  Object.assign(pen, { strokeStyle: look.colour, lineWidth: look.width ?? 2, globalAlpha: look.alpha ?? 1 });
  pen.setLineDash(look.dash ?? []);
  pen.beginPath();
  let down = false;
  for (let row = 0; row < count; row = row < count - 1 ? Math.min(row + stride, count - 1) : count) {
    const point = place(row);
    if (point === null) { down = false; continue; }
    if (down && !point[2]) pen.lineTo(point[0], point[1]); else pen.moveTo(point[0], point[1]);
    down = true;
  }
  pen.stroke();
  pen.restore();
}

// An arrow that points `towards` (rad, clockwise from up), its middle at (x, y).
function arrow(pen, x, y, towards, colour) {
  pen.save();
  pen.translate(x, y);
  pen.rotate(towards);
  Object.assign(pen, { strokeStyle: colour, fillStyle: colour, lineWidth: 2 });
  pen.beginPath();
  pen.moveTo(0, 11);
  pen.lineTo(0, -4);
  pen.stroke();
  pen.beginPath();
  pen.moveTo(0, -12);
  pen.lineTo(5, -2);
  pen.lineTo(-5, -2);
  pen.closePath();
  pen.fill();
  pen.restore();
}

const LEAST_HULL = 22; // px: a ship is never drawn too small to see
const LEAST_BEAM = 1 / 7; // of the drawn length

// A ship seen from above, `length` and `beam` in px, its middle at [left, top], its bow at `psi` from north.
function hull(pen, [left, top], psi, length, beam, look) {
  const long = Math.max(length, LEAST_HULL);
  const half = Math.max(beam, long * LEAST_BEAM) / 2;
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
  pen.globalAlpha = look.alpha ?? 1;
  if (look.fill) { pen.fillStyle = look.fill; pen.fill(); }
  if (look.stroke) { pen.strokeStyle = look.stroke; pen.lineWidth = look.width ?? 1.8; pen.stroke(); }
  pen.restore();
}
