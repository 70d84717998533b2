"use strict";
// Ships: instances of the FMI 3 library of the FMU, compiled to WebAssembly, called by its own functions.

class Ship {
  static async aboard(data) {
    const bytes = Uint8Array.from(atob(data.library), (letter) => letter.charCodeAt(0));
    const { instance } = await WebAssembly.instantiate(bytes, {});
    instance.exports._initialize();
    return new Ship(instance.exports, data);
  }

  constructor(library, data) {
    this.library = library;
    this.data = data;
    this.references = data.references;
    // Scratch memory: a value reference, a value, flags, the time come to, a state of the FMU (none yet).
    this.room = library.malloc(64);
    this.state = library.malloc(4);
    this.memory().setUint32(this.state, 0, true);
    const [name, token] = [this.#text("ship"), this.#text(data.token)];
    this.self = library.fmi3InstantiateCoSimulation(name, token, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
    if (!this.self) throw new Error("the ship in this page cannot be started");
  }

  // One more ship of the same library.
  another() { return new Ship(this.library, this.data); }

  memory() {
    const { buffer } = this.library.memory;
    if (this.view?.buffer !== buffer) this.view = new DataView(buffer); // memory that has grown is another
    return this.view;
  }

  #text(letters) {
    const bytes = new TextEncoder().encode(`${letters}\0`);
    const place = this.library.malloc(bytes.length);
    new Uint8Array(this.library.memory.buffer).set(bytes, place);
    return place;
  }

  #done(status, what) {
    if (status !== 0) throw new Error(`${what} (FMI status ${status})`);
  }

  has(name) { return name in this.references; }

  set(name, value) {
    const memory = this.memory();
    memory.setUint32(this.room, this.references[name], true);
    memory.setFloat64(this.room + 8, value, true);
    this.#done(this.library.fmi3SetFloat64(this.self, this.room, 1, this.room + 8, 1), `${name} cannot be ${value}`);
  }

  setTruth(name, value) {
    const memory = this.memory();
    memory.setUint32(this.room, this.references[name], true);
    memory.setUint8(this.room + 8, value ? 1 : 0);
    this.#done(this.library.fmi3SetBoolean(this.self, this.room, 1, this.room + 8, 1), `${name} cannot be set`);
  }

  get(name) {
    this.memory().setUint32(this.room, this.references[name], true);
    this.#done(this.library.fmi3GetFloat64(this.self, this.room, 1, this.room + 8, 1), `${name} cannot be read`);
    return this.memory().getFloat64(this.room + 8, true);
  }

  // A function that reads these signals in one call; what it returns holds until the next call.
  reader(names) {
    const [wanted, found] = [this.library.malloc(4 * names.length), this.library.malloc(8 * names.length)];
    names.forEach((name, place) => this.memory().setUint32(wanted + 4 * place, this.references[name], true));
    return () => {
      const status = this.library.fmi3GetFloat64(this.self, wanted, names.length, found, names.length);
      this.#done(status, "the motion cannot be read");
      return new Float64Array(this.library.memory.buffer, found, names.length);
    };
  }

  begin(values) {
    this.#done(this.library.fmi3Reset(this.self), "the ship cannot be put back");
    for (const [name, value] of Object.entries(values)) this.set(name, value);
    this.#done(this.library.fmi3EnterInitializationMode(this.self, 0, 0, 0, 0, 0), "the ship cannot begin");
    this.#done(this.library.fmi3ExitInitializationMode(this.self), "there is no start with these values");
  }

  // One Runge-Kutta step of `size` s, no longer than the model's own.
  step(time, size) {
    const at = this.room + 16;
    const status = this.library.fmi3DoStep(this.self, time, size, 0, at, at + 1, at + 2, at + 8);
    this.#done(status, `the motion leaves all bounds at ${time.toFixed(1)} s`);
  }

  keep() { this.#done(this.library.fmi3GetFMUState(this.self, this.state), "the state cannot be kept"); }

  back() {
    const kept = this.memory().getUint32(this.state, true);
    this.#done(this.library.fmi3SetFMUState(this.self, kept), "the state cannot be put back");
  }
}
