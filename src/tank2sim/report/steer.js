"use strict";
// The bridge: sliders, keys and readouts on one side, the voyage on the other.
(async () => {
  const data = JSON.parse(document.getElementById("ship").textContent);
  const find = (name) => document.getElementById(name);
  const deg = Math.PI / 180;
  const track = new TrackChart(find("track"), data);
  const history = new HistoryChart(find("history"), data);
  const sliders = Object.fromEntries(data.controls.map((one) => [one.name, { ...one, input: find(`set-${one.name}`) }]));
  const rudder = sliders["rudder.command"];
  const engine = sliders["propeller.speed"];
  let voyage = null;
  let sailing = false;
  let last = 0;
  let goal = 0;
  const held = {}; // inputs set by hand, but rudder and engine, SI
  let approach = {}; // as the page was written, to the last digit, until it is set by hand

  const say = (text) => { find("said").textContent = text; };

  function shown(value, digits) {
    const text = value.toFixed(digits);
    return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "\u2212");
  }

  function clock(time) {
    const whole = Math.floor(time + 1e-6);
    return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
  }

  // What the ship does, on paper too.
  function show(paper = false) {
    track.draw(voyage.samples, voyage.time, paper);
    history.draw(voyage.samples, paper);
    find("read-time").textContent = clock(voyage.time);
    for (const one of data.readouts) {
      let value = voyage.ship.get(one.name) * one.factor;
      if (one.name === "motion.psi") value = ((value % 360) + 360) % 360;
      if (one.name === "validity") find("read-validity").parentElement.classList.toggle("outside", value < 0.5);
      find(`read-${one.name}`).textContent = shown(value, one.digits);
    }
    for (const one of [rudder, engine]) {
      if (!one) continue;
      const value = (voyage.orders[one.name] ?? one.start) * one.factor;
      if (document.activeElement !== one.input || voyage.zigzag) one.input.value = value;
      find(`now-${one.name}`).textContent = `${shown(value, one.unit === "rpm" ? 1 : 0)} ${one.unit}`;
    }
    find("finish").disabled = !voyage.zigzag && voyage.programme.length === 0;
  }

  function stop(words) {
    sailing = false;
    find("run").textContent = "Start";
    find("run").setAttribute("aria-pressed", "false");
    if (words) say(words);
  }

  function start() {
    if (voyage.full) { say("The record is full: reset to go on."); return; }
    sailing = true;
    last = performance.now();
    goal = voyage.time;
    find("run").textContent = "Stop";
    find("run").setAttribute("aria-pressed", "true");
    requestAnimationFrame(frame);
  }

  function ended(what) {
    if (what === "programme") return "The trial's orders have ended.";
    const { overshoots, rudder: angle, heading } = voyage.done;
    const told = overshoots.map((one) => shown(one / deg, 1)).join(", ");
    const name = `Zigzag ${shown(angle / deg, 0)}/${shown(heading / deg, 0)}`;
    if (overshoots.length < Zigzag.EXECUTES - 1) return `${name} was given up: the heading is not reached.`;
    return `${name} has ended; overshoots ${told} deg.`;
  }

  // Sails until `until` (s) or the end of a manoeuvre, for at most `most` ms.
  function sail(until, most) {
    const begun = performance.now();
    try {
      while (voyage.time < until - 1e-9 && performance.now() - begun < most) {
        const what = voyage.advance();
        if (what) return ended(what);
        if (voyage.full) return "The record is full: reset to go on.";
      }
    } catch (error) {
      return error.message;
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

  // What was set by hand stays, but for rudder and engine.
  function reset() {
    stop();
    try {
      voyage.begin({ ...data.start, ...approach }, { ...(engine ? { [engine.name]: engine.start } : {}), ...held });
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
    if (slider === rudder) { voyage.zigzag = null; voyage.programme = []; }
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
    voyage.startZigzag(angle * deg, heading * deg);
    say(`Zigzag ${angle}/${heading} is executed.`);
    if (!sailing) start();
    show();
  }

  // The trial's orders from the start, each once.
  function follow() {
    reset();
    const { t, rudder: angles, engine: speeds } = data.ghost;
    const programme = [];
    let [held, turning] = [null, null];
    t.forEach((time, row) => {
      const one = { t: time };
      if (angles[row] !== null && angles[row] !== held) one["rudder.command"] = held = angles[row];
      if (engine && speeds[row] !== null && speeds[row] !== turning) one["propeller.speed"] = turning = speeds[row];
      if (Object.keys(one).length > 1) programme.push(one);
    });
    voyage.follow([...programme, { t: t.at(-1) }]);
    say("Steered as in the trial.");
    start();
    show();
  }

  function finish() {
    stop();
    const words = sail(Infinity, 20000);
    say(words ?? "It takes too long: go on with Start.");
    show();
  }

  function save() {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([voyage.csv(`steered in the page of ${data.name}`, engine)], { type: "text/csv" }));
    link.download = "steered.csv";
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  function listen() {
    find("run").addEventListener("click", () => (sailing ? stop("Stopped.") : start()));
    find("reset").addEventListener("click", reset);
    find("midships").addEventListener("click", () => order(rudder, 0));
    find("zigzag").addEventListener("click", zigzag);
    find("finish").addEventListener("click", finish);
    find("follow")?.addEventListener("click", follow);
    find("save").addEventListener("click", save);
    find("approach").addEventListener("change", () => {
      approach = { "initial.u": Number(find("approach").value) / data.knots };
      reset();
    });
    find("failed")?.addEventListener("change", (event) =>
      voyage.ship.setTruth("steering.failed", event.target.checked));
    for (const one of Object.values(sliders)) {
      one.input.addEventListener(one === rudder || one === engine ? "input" : "change", () => {
        const value = Number(one.input.value);
        if (one.input.value !== "" && Number.isFinite(value)) order(one, value);
      });
    }
    document.addEventListener("keydown", key);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => show());
    addEventListener("resize", () => show());
    addEventListener("beforeprint", () => show(true));
    addEventListener("afterprint", () => show());
  }

  const now = (slider) => voyage.orders[slider.name] * slider.factor;
  const faster = (by) => { const box = find("factor"); box.selectedIndex = Math.min(box.length - 1, Math.max(0, box.selectedIndex + by)); };

  function key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target.matches("input[type=number], select")) return;
    const by = event.shiftKey ? 5 : 1;
    const keys = {
      ArrowLeft: () => order(rudder, now(rudder) - by),
      ArrowRight: () => order(rudder, now(rudder) + by),
      ArrowUp: () => engine && order(engine, now(engine) + by),
      ArrowDown: () => engine && order(engine, now(engine) - by),
      m: () => order(rudder, 0),
      z: zigzag,
      r: reset,
      "+": () => faster(1),
      "-": () => faster(-1),
    };
    if (event.key === " " && !event.target.matches("button, input, summary")) {
      event.preventDefault();
      find("run").click();
    }
    const what = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!what || (event.key.startsWith("Arrow") && !engine && /Up|Down/.test(event.key))) return;
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
