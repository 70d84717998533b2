// Numbers, times and orders in words.

const DEG = Math.PI / 180;

function shown(value, digits) {
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "\u2212");
}

// With no more digits than it has, two at most.
const plain = (value) => String(Number(value.toFixed(2))).replace("-", "\u2212");

function clock(time) {
  const whole = Math.floor(time + 1e-6);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

// A heading (deg) within 0 and 360, with these digits.
const compass = (value, digits) => Number((((value % 360) + 360) % 360).toFixed(digits)) % 360;

const course = (angle) => String(Math.round(compass(angle / DEG, 0))).padStart(3, "0");

// An order of the rudder or the engine (in the unit of its control) as one says it, with its side.
function spoken(one, value) {
  if (one.name === "turn") return turned(one, value);
  const rudder = one.name === "rudder.command";
  const digits = one.unit === "rpm" ? (one.name === "propeller.speed" ? 1 : 0) : Number.isInteger(Number(value.toFixed(6))) ? 0 : 1;
  const size = `${shown(Math.abs(value), digits)} ${one.unit}`;
  if (Number(Math.abs(value).toFixed(digits)) === 0) return rudder ? "midships" : "stopped";
  return `${size} ${rudder ? (value > 0 ? "starboard" : "port") : (value > 0 ? "ahead" : "astern")}`;
}

// A difference of revolutions, with the side to which it turns.
function turned(one, value) {
  const size = shown(Math.abs(value), 0);
  return size === "0" ? "even" : `${size} ${one.unit} to ${value > 0 ? "starboard" : "port"}`;
}

const titled = ({ first, rudder, heading, unit }) => `Zigzag ${plain(first * rudder / unit)}/${plain(heading / DEG)}`;

// What has ended, with the overshoots of a zigzag.
function ended(what, voyage) {
  if (what === "programme") return "The trial's orders have ended.";
  const { overshoots } = voyage.done;
  const figures = overshoots.map((one) => shown(one / DEG, 1)).join(", ");
  const whole = overshoots.length === Zigzag.EXECUTES - 1;
  if (!whole) return `${titled(voyage.done)} was given up: the heading is not reached.`;
  return `${titled(voyage.done)} has ended; overshoots ${figures} deg.`;
}

const LEFT = {
  zigzag: "the zigzag is over", programme: "the trial's orders are left", autopilot: "the autopilot is off",
};

// How an attempt in a scenario has ended.
function judged({ aground, arrived, points }) {
  if (aground) return `Aground on ${aground.by} at ${clock(aground.time)}.`;
  return `The goal is reached at ${clock(arrived.time)}: ${points.toFixed(0)} of 100 points.`;
}
