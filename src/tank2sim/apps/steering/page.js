// The bridge: what the hand sets on one side, the voyage on the other.
const LEVER_STEP = 0.1; // of a lever's way by a key or a button of a gamepad (project choice)
const LEVER_KEYS = [["u", "j"], ["i", "k"]]; // up and down of the first two thrusters
(async () => {
  const data = JSON.parse(document.getElementById("ship").textContent);
  const find = (name) => document.getElementById(name);
  const view = new View(data.length);
  const waters = data.scenario ? new Waters(data.scenario, data) : null;
  const track = new TrackChart(find("track"), data, view, waters);
  const history = new HistoryChart(find("history"), data, Number(find("stretch").value));
  const tape = new HeadingTape(find("tape"));
  const turning = new Dial(find("turning"), data.turning[0], data.turning);
  const levers = data.thrusters.length > 0 ? new Levers(data.thrusters) : null; // a craft has no rudder
  const rudderDial = new Dial(find("rudder-dial"), data.largestRudder);
  const gamepad = new GamepadHelm();
  const sliders = Object.fromEntries(
    data.controls.map((one) => [one.name, { ...one, input: find(`set-${one.name}`) }]));
  const rudder = sliders["rudder.command"];
  const engine = sliders["propeller.speed"];
  const both = levers && Object.fromEntries(data.levers.map((one) => [one.name, { ...one, input: find(`set-${one.name}`) }]));
  const helms = levers ? levers.names.map((name) => sliders[name]) : [rudder, ...(engine ? [engine] : [])];
  const telegraph = engine &&
    new Telegraph(find("telegraph"), data.telegraph, (value) => order(engine, value * engine.factor));
  let helm = null;
  let sailing = false;
  let last = 0;
  let goal = 0;
  let pointed = false; // the last touch was by a pointer, not by a key
  let paper = false;
  let sharing = false; // the address is about to change by the page itself
  let predicted = { at: -Infinity, places: [] };
  const held = {}; // inputs set by hand, but rudder and engine, SI
  let wanted = null; // of a craft: the mean and the difference that were asked for, rad/s; the turn may hold back the mean
  let approach = {}; // as the page was written, to the last digit, until it is set by hand

  const say = (text) => { find("said").textContent = text; };
  const own = () => helm.own;

  // What the ship does.
  function show() {
    const voyage = own();
    const seen = find("members")?.checked ? helm.sailing : [];
    track.draw(voyage, seen, ahead(), paper);
    history.draw(voyage.samples, paper);
    find("read-time").textContent = clock(voyage.time);
    const now = {};
    for (const one of data.readouts) {
      let value = voyage.ship.get(one.name) * one.factor;
      now[one.name] = value;
      if (one.name === "motion.psi") value = compass(value, one.digits);
      if (one.name === "validity") find("read-validity").closest("div").classList.toggle("outside", value < 0.5);
      find(`read-${one.name}`).textContent = shown(value, one.digits);
    }
    tape.draw(now["motion.psi"], voyage.course === null ? null : voyage.course / DEG, paper);
    turning.draw(now["motion.r"], null, paper);
    for (const one of helms) showOrder(one);
    if (levers) showLevers(voyage);
    else rudderDial.draw(now["rudder.angle"], voyage.orders["rudder.command"] / DEG, paper);
    if (helm.score) showScore(helm.score);
    telegraph?.show(voyage.orders[engine.name]);
    find("autopilot")?.setAttribute("aria-pressed", String(voyage.course !== null));
    if (voyage.course !== null && document.activeElement !== find("course")) {
      find("course").value = course(voyage.course);
    }
    for (const mode of ["follow", "whole"]) find(mode).setAttribute("aria-pressed", String(view.mode === mode));
    find("finish").disabled = !voyage.zigzag && voyage.programme.length === 0 && !helm.replayed;
  }

  // Where the ship comes to: computed again after an order, and ten times a second.
  function ahead() {
    const seconds = Number(find("ahead").value);
    if (seconds === 0) return [];
    const now = performance.now();
    if (helm.time !== predicted.time && now - predicted.at > 100 || predicted.orders !== helm.attempt.version ||
      predicted.seconds !== seconds) {
      const places = own().ahead(seconds, seconds / 60);
      predicted = { at: now, places, seconds, time: helm.time, orders: helm.attempt.version };
    }
    return predicted.places;
  }

  function showScore(score) {
    find("score-points").textContent = score.points.toFixed(0);
    find("score-off").textContent = `${score.rms.toFixed(0)} m rms, ${score.most.toFixed(0)} m at most`;
    find("score-out").textContent = clock(score.out);
    find("score-buoys").textContent = String(score.buoys.size);
    find("score-aground").textContent = score.aground ? `${score.aground.by}, ${clock(score.aground.time)}` : "no";
    find("score-goal").textContent = score.arrived ? `reached, ${clock(score.arrived.time)}` : "not reached";
    const aground = helm.members.filter((member) => member.aground).length;
    if (find("score-members")) find("score-members").textContent = `${aground} of ${helm.members.length}`;
  }

  function showOrder(one) {
    const value = (own().orders[one.name] ?? one.start) * one.factor;
    one.input.value = value;
    const words = spoken(one, value);
    find(`now-${one.name}`).textContent = words;
    if (one.input.getAttribute("aria-valuetext") !== words) one.input.setAttribute("aria-valuetext", words);
    showGauge(one, own().ship.get(answering(one)) * one.factor);
  }

  // What follows an order.
  function answering(one) {
    if (levers) return one.name.replace("command", "speed");
    return one === rudder ? "rudder.angle" : "propeller.speed_actual";
  }

  // Of a craft: the two levers over both thrusters, and the dial of the difference as it is and as it is ordered.
  function showLevers(voyage) {
    const { mean, difference } = levers.read(voyage.orders);
    const speeds = Object.fromEntries(levers.names.map((name) => [name, voyage.ship.get(name.replace("command", "speed"))]));
    const turning = levers.read(speeds).difference;
    const { surge, turn } = both;
    for (const [one, value] of [[surge, mean], [turn, difference]]) {
      one.input.value = value * one.factor;
      const words = spoken(one, value * one.factor);
      find(`now-${one.name}`).textContent = words;
      if (one.input.getAttribute("aria-valuetext") !== words) one.input.setAttribute("aria-valuetext", words);
    }
    showGauge(surge, levers.read(speeds).mean * surge.factor);
    showGauge(turn, turning * turn.factor);
    find("read-difference").textContent = shown(turning * turn.factor, 0);
    rudderDial.draw(turning * turn.factor, difference * turn.factor, paper);
  }

  // The levers over both thrusters: a mean or a difference, rad/s, from what was asked for last.
  function drive(change) {
    wanted = { ...(wanted ?? levers.read(own().orders)), ...change };
    const kept = wanted;
    for (const [name, value] of Object.entries(levers.orders(kept))) order(sliders[name], value * sliders[name].factor);
    wanted = kept;
  }

  // One step of a lever, `share` of its way from the middle.
  const stepped = (what, share) => {
    const [now, one] = [wanted ?? levers.read(own().orders), both[what === "mean" ? "surge" : "turn"]];
    const [low, high] = [one.minimum / one.factor, one.maximum / one.factor];
    drive({ [what]: Math.max(low, Math.min(high, now[what] + share * high)) });
  };

  // The rudder and the revolutions as they are, below the order.
  function showGauge(one, value) {
    const part = (at) => 100 * Math.max(0, Math.min(1, (at - one.minimum) / (one.maximum - one.minimum)));
    const bar = find(`gauge-${one.name}`);
    bar.style.left = `${part(Math.min(0, value))}%`;
    bar.style.width = `${Math.abs(part(value) - part(0))}%`;
    bar.className = one === rudder || one.name === "turn" ? (value < 0 ? "port" : "starboard") : "engine";
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
    goal = helm.time;
    find("run").textContent = "Stop";
    find("run").setAttribute("aria-pressed", "true");
    say(words ?? (helm.replayed ? "Replayed." : "Under way."));
    requestAnimationFrame(frame);
  }

  // Sails until `until` (s) or the end of a manoeuvre, for at most `most` ms. Returns what is to be said, or null.
  function sail(until, most) {
    const begun = performance.now();
    if (helm.score?.aground) return `${judged(helm.score)} Reset to begin again.`;
    try {
      while (helm.time < until - 1e-9 && performance.now() - begun < most) {
        const what = helm.advance();
        if (what === "aground" || what === "arrived") return judged(helm.score);
        if (what === "replay") return `The attempt has been replayed, until ${clock(helm.time)}.`;
        if (what && !helm.replayed) return ended(what, own());
      }
    } catch (error) {
      return `${error.message}: reset to go on.`;
    }
    return null;
  }

  function frame(now) {
    byGamepad();
    if (!sailing) return;
    const wanted = Math.min(100, now - last) / 1000 * Number(find("factor").value);
    last = now;
    goal += wanted;
    const words = sail(goal, 40);
    if (goal - helm.time > wanted + own().step) goal = helm.time; // slower than asked: the page keeps alive
    if (words) stop(words);
    show();
    if (sailing) requestAnimationFrame(frame);
  }

  // What was set by hand stays, except rudder and engine. With an `attempt` all is as it was then.
  function reset(attempt = null) {
    stop();
    wanted = null;
    const given = Object.fromEntries(data.controls.map((one) => [one.name, one.start]));
    try {
      if (attempt) helm.begin(attempt.start, attempt.orders, attempt);
      else helm.begin({ ...data.start, ...approach }, { ...given, ...held });
      if (!attempt && find("failed")?.checked) helm.fail(true);
      say("At the start.");
    } catch (error) {
      say(error.message);
    }
    track.forget();
    show();
  }

  // By hand, so that a replay is over.
  function byHand() { helm.replayed = null; }

  function order(slider, value) {
    byHand();
    const kept = Math.min(slider.maximum ?? Infinity, Math.max(slider.minimum ?? -Infinity, value));
    const left = LEFT[helm.order(slider.name, kept / slider.factor)];
    if (left) say(`Steered by hand: ${left}.`);
    wanted = null;
    if (!helms.includes(slider)) held[slider.name] = kept / slider.factor;
    slider.input.value = kept;
    show();
  }

  // The autopilot on the course of its field; `change` (deg) moves it first.
  function steer(change = 0) {
    const input = find("course");
    if (!input) return;
    const wanted = typed(input, "The course", "deg", 0, 360);
    if (wanted === null) return;
    byHand();
    const to = compass(Math.round(wanted) + change, 0); // a helmsman is given whole degrees
    input.value = course(to * DEG);
    helm.steer(to * DEG);
    say(`The autopilot steers ${input.value}.`);
    show();
  }

  function toggleAutopilot() {
    if (own().course === null) return steer();
    byHand();
    helm.release();
    say("The autopilot is off: the rudder stays as it is.");
    show();
  }

  function zigzag() {
    const [angle, heading] = [Number(find("zigzag-rudder").value), Number(find("zigzag-heading").value)];
    if (levers) return zigzagByDifference(angle, heading);
    if (!(Math.abs(angle) > 0 && Math.abs(angle) < 90 && heading > 0 && heading < 90)) {
      say("A zigzag needs a rudder angle, negative to begin to port, and a heading above 0, both below 90 deg.");
      return;
    }
    byHand();
    const limited = data.stop !== null && Math.abs(angle) > data.stop + 1e-9;
    helm.zigzag(limited ? Math.sign(angle) * data.stop * DEG : angle * DEG, heading * DEG);
    const lines = [`${titled(own().zigzag)} is executed.`];
    if (limited) lines.push(`The rudder was to go to ${plain(angle)} deg: its gear stops at ${plain(data.stop)} deg.`);
    const words = lines.join(" ");
    if (sailing) say(words); else start(words);
    show();
  }

  function zigzagByDifference(difference, heading) {
    const { turn } = both;
    if (!(Math.abs(difference) > 0 && Math.abs(difference) <= turn.maximum && heading > 0 && heading < 90)) {
      say(`A zigzag needs a difference up to ${plain(turn.maximum)} rpm, negative to begin to port, and a heading above 0 ` +
        "and below 90 deg.");
      return;
    }
    byHand();
    wanted = null;
    helm.zigzag(difference / turn.factor, heading * DEG);
    const words = `${titled(own().zigzag)} is executed.`;
    if (sailing) say(words); else start(words);
    show();
  }

  function follow() {
    reset();
    helm.follow();
    start(data.ghost.angle ? "Steered as in the trial: the rudder follows the measured angle." :
      "Steered by the trial's orders.");
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
      if (own().recorded.includes(one.name)) continue;
      const from = own().changes.filter(([, name]) => name === one.name);
      const start = [0, one.name, own().begun[one.name]];
      const words = [start, ...from].map(([t, , value]) => `${plain(value * one.factor)} ${one.unit} at ${plain(t)} s`);
      lines.push(`${one.label}: ${words.join(", ")}`);
    }
    return lines;
  }

  function save() {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([own().csv(comments())], { type: "text/csv" }));
    link.download = "steered.csv";
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  // The attempt from its start, at the pace that is set.
  function replay() {
    const attempt = helm.attempt;
    reset(attempt);
    start("Replayed.");
  }

  // A link to this page with the attempt in it: in the address, in the field, and where copying is allowed, copied.
  async function share() {
    const text = helm.attempt.text(data);
    if (text.length > Attempt.MOST_TEXT) {
      say(`The attempt has too many orders for a link (${text.length} letters): save the voyage.`);
      return;
    }
    const link = `${location.href.split("#")[0]}#${text}`;
    sharing = location.hash.slice(1) !== text;
    location.hash = text;
    find("link").value = link;
    find("link").hidden = false;
    try {
      await navigator.clipboard.writeText(link);
      say("The link to this attempt is copied.");
    } catch {
      find("link").select();
      say("The link to this attempt is in the address and below.");
    }
  }

  // The attempt in the address, replayed from its start. A link of another page is reported.
  function opened() {
    const [text, byPage] = [location.hash.slice(1), sharing];
    sharing = false;
    if (byPage || !text.includes("~")) return;
    try {
      reset(Attempt.parse(decodeURIComponent(text), data));
      start("Replayed from the link.");
    } catch (error) {
      say(`${error.message}.`);
    }
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
    const value = typed(input, "The approach speed", data.speeds.unit, Number(input.min), Number(input.max));
    const said = find("said").textContent;
    if (value === null) { input.value = input.dataset.last; return; }
    const limited = value !== Number(input.value);
    if (limited) input.value = String(Number(value.toFixed(2)));
    input.dataset.last = input.value;
    approach = { "initial.u": value / data.speeds.factor };
    reset();
    if (limited) say(said);
  }

  function setByHand(one) {
    const value = typed(one.input, one.label, one.unit, one.minimum, one.maximum);
    if (value === null) one.input.value = String(Number((own().orders[one.name] * one.factor).toPrecision(6)));
    else order(one, value);
  }

  function byGamepad() {
    for (const done of gamepad.read((both?.turn ?? rudder).maximum)) {
      if (done.rudder !== undefined) turnTo(done.rudder);
      else if (done === "start") find("run").click();
      else if (done === "midships") turnTo(0);
      else if (levers) stepped("mean", done === "ahead" ? LEVER_STEP : -LEVER_STEP);
      else telegraph?.step(done === "ahead" ? 1 : -1, own().orders[engine.name]);
    }
  }

  // The rudder, or the difference of a craft's thrusters, in the unit of its slider.
  function turnTo(value) {
    if (levers) drive({ difference: value / both.turn.factor }); else order(rudder, value);
  }

  // After a pointer the keys are the bridge's again; who goes by keys keeps the focus.
  function letGo(event) {
    const kind = "button, input[type=range], input[type=checkbox], select, summary";
    if (pointed && event.target.matches?.(kind)) event.target.blur();
  }

  function look(what) {
    what();
    show();
  }

  function listen() {
    const clicks = {
      run: () => (sailing ? stop(`Stopped at ${clock(helm.time)}.`) : start()), reset: () => reset(),
      midships: () => turnTo(0), halt: () => drive({ mean: 0, difference: 0 }), zigzag, finish, save, replay, share, follow: () => look(() => view.follow()),
      whole: () => look(() => view.whole()), closer: () => look(() => view.zoom(View.STEP)),
      farther: () => look(() => view.zoom(1 / View.STEP)), autopilot: toggleAutopilot, trial: follow,
    };
    for (const [name, does] of Object.entries(clicks)) find(name)?.addEventListener("click", does);
    find("approach").addEventListener("change", setApproach);
    find("course")?.addEventListener("change", () => { if (own().course !== null) steer(); });
    find("stretch").addEventListener("change", (event) => { history.stretch = Number(event.target.value); show(); });
    for (const name of ["ahead", "members"]) find(name)?.addEventListener("change", show);
    find("failed")?.addEventListener("change", (event) => { byHand(); helm.fail(event.target.checked); });
    for (const one of Object.values(sliders)) {
      const slides = helms.includes(one);
      const changed = slides ? () => order(one, Number(one.input.value)) : () => setByHand(one);
      one.input.addEventListener(slides ? "input" : "change", changed);
    }
    both?.surge.input.addEventListener("input", (event) => drive({ mean: Number(event.target.value) / both.surge.factor }));
    both?.turn.input.addEventListener("input", (event) => turnTo(Number(event.target.value)));
    moveByHand(find("track"), view, show);
    document.addEventListener("keydown", key);
    document.addEventListener("pointerdown", () => { pointed = true; }, true);
    document.addEventListener("click", (event) => { if (!event.target.matches("select")) letGo(event); });
    document.addEventListener("change", letGo);
    addEventListener("hashchange", opened);
    addEventListener("gamepadconnected", () => { say("A gamepad steers, too."); waiting(); });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", show);
    new ResizeObserver(show).observe(find("track"));
    addEventListener("beforeprint", () => { paper = true; show(); });
    addEventListener("afterprint", () => { paper = false; show(); });
  }

  // A gamepad is asked in each frame; while the ship is stopped, for its start.
  function waiting() {
    if (!sailing) byGamepad();
    if ([...navigator.getGamepads()].some((one) => one)) requestAnimationFrame(waiting);
  }

  const now = (slider) => own().orders[slider.name] * slider.factor;
  const choose = (name, by) => {
    const box = find(name);
    box.selectedIndex = Math.min(box.length - 1, Math.max(0, box.selectedIndex + by));
    show();
  };

  // Keys of the bridge. In a field they write; the arrows move the slider that has the focus; Space presses a button.
  function key(event) {
    pointed = false;
    const { target } = event;
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (target.matches("input[type=number], input[type=text], select")) return;
    if (event.key.startsWith("Arrow") && target.matches("input[type=range]")) return;
    if ([" ", "Enter"].includes(event.key) && target.matches("button, input[type=checkbox], summary, a")) return;
    const by = event.shiftKey ? 5 : 1;
    const way = event.shiftKey ? 1 : LEVER_STEP;
    const revolutions = (side) => (event.shiftKey ? order(engine, now(engine) + side) :
      telegraph.step(side, own().orders[engine.name]));
    const keys = {
      " ": () => find("run").click(),
      ArrowLeft: () => (levers ? stepped("difference", -way) : order(rudder, now(rudder) - by)),
      ArrowRight: () => (levers ? stepped("difference", way) : order(rudder, now(rudder) + by)),
      ...(levers ? {
        w: () => stepped("mean", way), s: () => stepped("mean", -way), x: () => drive({ mean: 0, difference: 0 }),
        ...Object.fromEntries(LEVER_KEYS.flatMap(([up, down], number) => [[up, 1], [down, -1]].map(([key, side]) =>
          [key, () => helms[number] && order(helms[number], now(helms[number]) + side * way * helms[number].maximum)]))),
      } : {}),
      ...(engine ? { w: () => revolutions(1), s: () => revolutions(-1) } : {}),
      m: () => turnTo(0),
      a: toggleAutopilot,
      ",": () => steer(-1),
      ".": () => steer(1),
      "<": () => steer(-10),
      ">": () => steer(10),
      z: zigzag,
      r: () => reset(),
      f: () => look(() => view.follow()),
      v: () => look(() => view.whole()),
      "+": () => look(() => view.zoom(View.STEP)),
      "-": () => look(() => view.zoom(1 / View.STEP)),
      "]": () => choose("factor", 1),
      "[": () => choose("factor", -1),
      p: () => choose("ahead", find("ahead").selectedIndex + 1 < find("ahead").length ? 1 : -find("ahead").length),
      g: () => find("members")?.click(),
    };
    const pressed = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const what = keys[pressed];
    if (!what) return;
    event.preventDefault();
    what();
    // The first order gets the ship under way.
    if (!sailing && helm.time === 0 && (pressed.startsWith("Arrow") || "wsm".includes(pressed))) start();
  }

  try {
    helm = new Helm(new Ship(data), data);
  } catch (error) {
    say(`The ship cannot be steered here: ${error.message}`);
    console.error(error);
    return;
  }
  if (data.ghost) helm.programmeOf = () => programme(data.ghost, engine !== undefined);
  for (const one of document.querySelectorAll(".bridge [disabled]")) one.disabled = false;
  listen();
  reset();
  document.documentElement.dataset.ship = "ready";
  opened();
})();
