// A gamepad: the left stick is the rudder, up and down the telegraph, A starts and stops, B puts the rudder midships.

class GamepadHelm {
  static DEAD = 0.12; // of the stick's way about its middle, which worn sticks do not find (project choice)
  static FINE = 0.5; // deg of rudder by which an order must differ from the one before
  static BUTTONS = { 0: "start", 1: "midships", 12: "ahead", 13: "astern" }; // of the standard layout of the W3C

  constructor() {
    this.pressed = new Set();
    this.rudder = 0;
  }

  // What was done since the last call: names of BUTTONS, and {rudder} in deg if the stick has moved; `most` is its end.
  read(most) {
    const pad = [...(navigator.getGamepads?.() ?? [])].find((one) => one?.connected);
    if (!pad) return [];
    const done = [];
    for (const [place, name] of Object.entries(GamepadHelm.BUTTONS)) {
      const down = pad.buttons[place]?.pressed ?? false;
      if (down && !this.pressed.has(name)) done.push(name);
      if (down) this.pressed.add(name); else this.pressed.delete(name);
    }
    const stick = pad.axes[0] ?? 0;
    const way = Math.max(0, Math.abs(stick) - GamepadHelm.DEAD) / (1 - GamepadHelm.DEAD) * Math.sign(stick);
    const rudder = Math.round(way * most / GamepadHelm.FINE) * GamepadHelm.FINE;
    if (rudder !== this.rudder) done.push({ rudder });
    this.rudder = rudder;
    return done;
  }
}
