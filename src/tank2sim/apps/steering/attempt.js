// A whole attempt: start, and every order with its time; as text for a link, and from it.

class Attempt {
  static CODES = { o: 2, c: 1, h: 0, z: 2, f: 0, x: 1 }; // numbers behind each order
  static MOST_TEXT = 60000; // letters of a link: what browsers and mail programs pass on

  constructor(start = {}, orders = {}) {
    Object.assign(this, { start, orders });
    this.events = []; // {t, code, values}
    this.end = 0;
    this.#changed();
  }

  static #count = 0;

  #changed() { this.version = Attempt.#count += 1; } // another after each order, and in each attempt

  // An order takes the place of one of the same kind at the same time: a slider that is dragged.
  note(t, code, values) {
    this.#changed();
    const last = this.events.at(-1);
    const same = code === "c" || (code === "o" && last?.values[0] === values[0]);
    if (same && last?.t === t && last.code === code) last.values = values;
    else this.events.push({ t, code, values });
  }

  // `~` between orders, `!` within: page, end, start values, inputs at the start, orders. A time is the number of its
  // whole step, or behind `@` in s; numbers have all their digits. Inputs are numbered as the page lists them.
  text({ id, step, controls }) {
    const time = (t) => (Math.round(t / step) * step === t ? String(Math.round(t / step)) : `@${t}`);
    const number = (name) => controls.findIndex((one) => one.name === name);
    const values = ({ code, values: given }) => (code === "o" ? [number(given[0]), given[1]] : given);
    return [
      id, time(this.end),
      ...Object.entries(this.start).map(([name, value]) => `s!${name}!${value}`),
      ...Object.entries(this.orders).map(([name, value]) => `i!${number(name)}!${value}`),
      ...this.events.map((one) => [time(one.t), one.code, ...values(one)].join("!")),
    ].join("~");
  }

  // The attempt of a text; throws where it is of another page, or no attempt.
  static parse(text, { id, step, controls, places }) {
    const [page, end, ...rest] = text.split("~");
    if (page !== id) {
      throw new Error("this link is of another page: of another ship, scenario or version of the program");
    }
    const broken = () => new Error("this link is broken: a part of it is missing");
    const real = (word) => {
      if (word === undefined || word === "" || !Number.isFinite(Number(word))) throw broken();
      return Number(word);
    };
    const time = (word) => (word?.startsWith("@") ? real(word.slice(1)) : real(word) * step);
    const name = (word) => {
      if (!controls[real(word)]) throw broken();
      return controls[real(word)].name;
    };
    const attempt = new Attempt();
    attempt.end = time(end);
    for (const [first, second, ...words] of rest.map((one) => one.split("!"))) {
      if (first === "s") {
        if (!(second in places)) throw broken();
        attempt.start[second] = real(words[0]);
      } else if (first === "i") attempt.orders[name(second)] = real(words[0]);
      else {
        if (words.length !== Attempt.CODES[second]) throw broken();
        const values = second === "o" ? [name(words[0]), real(words[1])] : words.map(real);
        attempt.events.push({ t: time(first), code: second, values });
      }
    }
    return attempt;
  }
}
