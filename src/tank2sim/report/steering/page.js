// The bridge: sliders, keys and readouts on one side, the voyage on the other.
(async () => {
  const data = JSON.parse(document.getElementById("ship").textContent);
  const find = (name) => document.getElementById(name);
  const deg = Math.PI / 180;
  const track = new TrackChart(find("track"), data);
  const history = new HistoryChart(find("history"), data, Number(find("stretch").value));
  const sliders = Object.fromEntries(
    data.controls.map((one) => [one.name, { ...one, input: find(`set-${one.name}`) }]));
  const rudder = sliders["rudder.command"];
  const engine = sliders["propeller.speed"];
  let voyage = null;
  let sailing = false;
  let last = 0;
  let goal = 0;
  let pointed = false; // the last touch was by a pointer, not by a key
  let paper = false;
  const held = {}; // inputs set by hand, but rudder and engine, SI
  let approach = {}; // as the page was written, to the last digit, until it is set by hand

  const say = (text) => { find("said").textContent = text; };

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

  // An order as one says it, with its side.
  function spoken(one, value) {
    const digits = one.unit === "rpm" ? 1 : Number.isInteger(Number(value.toFixed(6))) ? 0 : 1;
    const size = `${shown(Math.abs(value), digits)} ${one.unit}`;
    if (Number(Math.abs(value).toFixed(digits)) === 0) return one === rudder ? "midships" : "stopped";
    return `${size} ${one === rudder ? (value > 0 ? "starboard" : "port") : (value > 0 ? "ahead" : "astern")}`;
  }

  // What the ship does.
  function show() {
    track.draw(voyage.samples, voyage.time, voyage.orders, paper);
    history.draw(voyage.samples, paper);
    find("read-time").textContent = clock(voyage.time);
    for (const one of data.readouts) {
      let value = voyage.ship.get(one.name) * one.factor;
      if (one.name === "motion.psi") value = Number((((value % 360) + 360) % 360).toFixed(one.digits)) % 360;
      if (one.name === "validity") find("read-validity").closest("div").classList.toggle("outside", value < 0.5);
      find(`read-${one.name}`).textContent = shown(value, one.digits);
    }
    for (const one of [rudder, engine]) if (one) showOrder(one);
    find("finish").disabled = !voyage.zigzag && voyage.programme.length === 0;
  }

  function showOrder(one) {
    const value = (voyage.orders[one.name] ?? one.start) * one.factor;
    one.input.value = value;
    const words = spoken(one, value);
    find(`now-${one.name}`).textContent = words;
    if (one.input.getAttribute("aria-valuetext") !== words) one.input.setAttribute("aria-valuetext", words);
    showGauge(one, voyage.ship.get(one === rudder ? "rudder.angle" : "propeller.speed_actual") * one.factor);
  }

  // The rudder and the revolutions as they are, below the order.
  function showGauge(one, value) {
    const part = (at) => 100 * Math.max(0, Math.min(1, (at - one.minimum) / (one.maximum - one.minimum)));
    const bar = find(`gauge-${one.name}`);
    bar.style.left = `${part(Math.min(0, value))}%`;
    bar.style.width = `${Math.abs(part(value) - part(0))}%`;
    bar.className = one === engine ? "engine" : value < 0 ? "port" : "starboard";
  }

  function stop(words) {
    sailing = false;
    find("run").textContent = "Start";
    find("run").setAttribute("aria-pressed", "false");
    if (words) say(words);
  }

  function start(words) {
    sailing = true;
    last = performance.now();
    goal = voyage.time;
    find("run").textContent = "Stop";
    find("run").setAttribute("aria-pressed", "true");
    say(words ?? "Under way.");
    requestAnimationFrame(frame);
  }

  const titled = ({ first, rudder: angle, heading }) => `Zigzag ${plain(first * angle / deg)}/${plain(heading / deg)}`;

  function ended(what) {
    if (what === "programme") { voyage.release(); return "The trial's orders have ended."; }
    const { overshoots } = voyage.done;
    const figures = overshoots.map((one) => shown(one / deg, 1)).join(", ");
    const whole = overshoots.length === Zigzag.EXECUTES - 1;
    if (!whole) return `${titled(voyage.done)} was given up: the heading is not reached.`;
    return `${titled(voyage.done)} has ended; overshoots ${figures} deg.`;
  }

  // Sails until `until` (s) or the end of a manoeuvre, for at most `most` ms.
  function sail(until, most) {
    const begun = performance.now();
    try {
      while (voyage.time < until - 1e-9 && performance.now() - begun < most) {
        const what = voyage.advance();
        if (what) return ended(what);
      }
    } catch (error) {
      return `${error.message}: reset to go on.`;
    }
    return null;
  }

  function frame(now) {
    if (!sailing) return;
    const wanted = Math.min(100, now - last) / 1000 * Number(find("factor").value);
    last = now;
    goal += wanted;
    const words = sail(goal, 40);
    if (goal - voyage.time > wanted + voyage.step) goal = voyage.time; // slower than asked: the page keeps alive
    if (words) stop(words);
    show();
    if (sailing) requestAnimationFrame(frame);
  }

  // What was set by hand stays, except rudder and engine.
  function reset() {
    stop();
    const given = Object.fromEntries(data.controls.map((one) => [one.name, one.start]));
    try {
      voyage.begin({ ...data.start, ...approach }, { ...given, ...held });
      if (find("failed")) voyage.ship.setTruth("steering.failed", find("failed").checked);
      say("At the start.");
    } catch (error) {
      say(error.message);
    }
    track.forget();
    show();
  }

  function order(slider, value) {
    const kept = Math.min(slider.maximum ?? Infinity, Math.max(slider.minimum ?? -Infinity, value));
    if (slider === rudder) {
      const left = { zigzag: "the zigzag is over", programme: "the trial's orders are left" }[voyage.release()];
      if (left) say(`Steered by hand: ${left}.`);
    }
    voyage.order(slider.name, kept / slider.factor);
    if (slider !== rudder && slider !== engine) held[slider.name] = kept / slider.factor;
    slider.input.value = kept;
    show();
  }

  function zigzag() {
    const [angle, heading] = [Number(find("zigzag-rudder").value), Number(find("zigzag-heading").value)];
    if (!(Math.abs(angle) > 0 && Math.abs(angle) < 90 && heading > 0 && heading < 90)) {
      say("A zigzag needs a rudder angle, negative to begin to port, and a heading above 0, both below 90 deg.");
      return;
    }
    const limited = data.stop !== null && Math.abs(angle) > data.stop + 1e-9;
    voyage.startZigzag(limited ? Math.sign(angle) * data.stop * deg : angle * deg, heading * deg);
    const lines = [`${titled(voyage.zigzag)} is executed.`];
    if (limited) lines.push(`The rudder was to go to ${plain(angle)} deg: its gear stops at ${plain(data.stop)} deg.`);
    const words = lines.join(" ");
    if (sailing) say(words); else start(words);
    show();
  }

  // What steered the trial, from its start: orders each once, or the measured angle from reading to reading.
  function follow() {
    reset();
    const { t, angle, rudder: angles, engine: speeds } = data.ghost;
    const programme = [];
    let [rudderNow, engineNow] = [null, null];
    const read = t.map((_, row) => row).filter((row) => angles[row] !== null);
    const next = new Map(read.slice(0, -1).map((row, place) => [row, read[place + 1]]));
    t.forEach((time, row) => {
      const one = { t: time };
      if (angles[row] !== null && (angle || angles[row] !== rudderNow)) one["rudder.command"] = rudderNow = angles[row];
      if (angle && angles[row] !== null) {
        const after = next.get(row);
        one["ghost.rudder_rate"] = after === undefined ? 0 : (angles[after] - angles[row]) / (t[after] - time);
        one["ghost.steers"] = true;
      }
      if (engine && speeds[row] !== null && speeds[row] !== engineNow) one["propeller.speed"] = engineNow = speeds[row];
      if (Object.keys(one).length > 1) programme.push(one);
    });
    voyage.follow([...programme, { t: t.at(-1) }]);
    start(angle ? "Steered as in the trial: the rudder follows the measured angle." : "Steered by the trial's orders.");
    show();
  }

  function finish() {
    stop();
    const words = sail(Infinity, 20000);
    say(words ?? "It takes too long: go on with Start.");
    show();
  }

  // Lines at the head of a saved voyage: what no column of a trial holds.
  function comments() {
    const lines = [`steered in the page of ${data.name}`];
    for (const one of data.controls) {
      if (Voyage.ORDERS.includes(one.name)) continue;
      const from = voyage.changes.filter(([, name]) => name === one.name);
      const start = [0, one.name, voyage.begun[one.name]];
      const words = [start, ...from].map(([t, , value]) => `${plain(value * one.factor)} ${one.unit} at ${plain(t)} s`);
      lines.push(`${one.label}: ${words.join(", ")}`);
    }
    return lines;
  }

  function save() {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([voyage.csv(comments())], { type: "text/csv" }));
    link.download = "steered.csv";
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  // A number that was typed, brought within its bounds; null where there is none. Both are reported to the user.
  function typed(input, name, unit, low, high) {
    const value = Number(input.value);
    if (input.value.trim() === "" || !Number.isFinite(value)) {
      say(`${name}: a number was expected; it stays as it was.`);
      return null;
    }
    const kept = Math.min(high ?? Infinity, Math.max(low ?? -Infinity, value));
    const bounds = `${plain(low ?? -Infinity)} and ${plain(high ?? Infinity)} ${unit}`;
    if (kept !== value) say(`${name} lies between ${bounds}: ${plain(kept)} is taken.`);
    return kept;
  }

  function setApproach() {
    const input = find("approach");
    const value = typed(input, "The approach speed", "knots", Number(input.min), Number(input.max));
    const said = find("said").textContent;
    if (value === null) { input.value = input.dataset.last; return; }
    const limited = value !== Number(input.value);
    if (limited) input.value = String(Number(value.toFixed(2)));
    input.dataset.last = input.value;
    approach = { "initial.u": value / data.knots };
    reset();
    if (limited) say(said);
  }

  function setByHand(one) {
    const value = typed(one.input, one.label, one.unit, one.minimum, one.maximum);
    if (value === null) one.input.value = String(Number((voyage.orders[one.name] * one.factor).toPrecision(6)));
    else order(one, value);
  }

  // After a pointer the keys are the bridge's again; who goes by keys keeps the focus.
  function letGo(event) {
    const kind = "button, input[type=range], input[type=checkbox], select, summary";
    if (pointed && event.target.matches?.(kind)) event.target.blur();
  }

  function listen() {
    find("run").addEventListener("click", () => (sailing ? stop(`Stopped at ${clock(voyage.time)}.`) : start()));
    find("reset").addEventListener("click", reset);
    find("midships").addEventListener("click", () => order(rudder, 0));
    find("zigzag").addEventListener("click", zigzag);
    find("finish").addEventListener("click", finish);
    find("follow")?.addEventListener("click", follow);
    find("save").addEventListener("click", save);
    find("approach").addEventListener("change", setApproach);
    find("stretch").addEventListener("change", (event) => { history.stretch = Number(event.target.value); show(); });
    find("failed")?.addEventListener("change", (event) =>
      voyage.ship.setTruth("steering.failed", event.target.checked));
    for (const one of Object.values(sliders)) {
      const slides = one === rudder || one === engine;
      const changed = slides ? () => order(one, Number(one.input.value)) : () => setByHand(one);
      one.input.addEventListener(slides ? "input" : "change", changed);
    }
    document.addEventListener("keydown", key);
    document.addEventListener("pointerdown", () => { pointed = true; }, true);
    document.addEventListener("click", (event) => { if (!event.target.matches("select")) letGo(event); });
    document.addEventListener("change", letGo);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", show);
    new ResizeObserver(show).observe(find("track"));
    addEventListener("beforeprint", () => { paper = true; show(); });
    addEventListener("afterprint", () => { paper = false; show(); });
  }

  const now = (slider) => voyage.orders[slider.name] * slider.factor;
  const faster = (by) => {
    const box = find("factor");
    box.selectedIndex = Math.min(box.length - 1, Math.max(0, box.selectedIndex + by));
  };

  // Keys of the bridge. In a field they write; the arrows move the slider that has the focus; Space presses a button.
  function key(event) {
    pointed = false;
    const { target } = event;
    if (event.ctrlKey || event.altKey || event.metaKey || target.matches("input[type=number], select")) return;
    if (event.key.startsWith("Arrow") && target.matches("input[type=range]")) return;
    if (event.key === " " && target.matches("button, input[type=checkbox], summary, a")) return;
    const by = event.shiftKey ? 5 : 1;
    const keys = {
      " ": () => find("run").click(),
      ArrowLeft: () => order(rudder, now(rudder) - by),
      ArrowRight: () => order(rudder, now(rudder) + by),
      ...(engine ? { w: () => order(engine, now(engine) + by), s: () => order(engine, now(engine) - by) } : {}),
      m: () => order(rudder, 0),
      z: zigzag,
      r: reset,
      "+": () => faster(1),
      "-": () => faster(-1),
    };
    const what = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!what) return;
    event.preventDefault();
    what();
  }

  try {
    voyage = new Voyage(await Ship.aboard(data), data);
  } catch (error) {
    say(`The ship cannot be steered here: ${error.message}`);
    console.error(error);
    return;
  }
  for (const one of document.querySelectorAll(".bridge [disabled]")) one.disabled = false;
  listen();
  reset();
  document.documentElement.dataset.ship = "ready";
})();
