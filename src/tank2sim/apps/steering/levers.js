// Two levers of a craft with thrusters on both sides: the revolutions that both have, and their difference.

class Levers {
  // `thrusters` are {name, side, minimum, maximum} of their orders, rad/s; side 1: one that pushes ahead turns the craft
  // to starboard, -1 to port, 0 neither.
  constructor(thrusters) {
    this.thrusters = thrusters;
    this.names = thrusters.map((one) => one.name);
    this.low = Math.max(...thrusters.map((one) => one.minimum));
    this.high = Math.min(...thrusters.map((one) => one.maximum));
  }

  has(name) { return this.names.includes(name); }

  // Orders by name from the mean and from the difference, port less starboard, so that it is positive to starboard. The
  // turn comes first: the mean is brought within what the difference leaves.
  orders({ mean, difference }) {
    const turned = Math.max(this.low - this.high, Math.min(this.high - this.low, difference));
    const room = Math.abs(turned) / 2;
    const both = Math.max(this.low + room, Math.min(this.high - room, mean));
    return Object.fromEntries(this.thrusters.map(({ name, side }) => [name, both + side * turned / 2]));
  }

  // Mean and difference of orders by name.
  read(orders) {
    const sided = (side) => {
      const found = this.thrusters.filter((one) => one.side === side).map((one) => orders[one.name]);
      return found.reduce((sum, one) => sum + one, 0) / found.length;
    };
    return { mean: (sided(1) + sided(-1)) / 2, difference: sided(1) - sided(-1) };
  }

  // Orders as shares of the largest ones, ahead or astern, as trial files have them: column to name and conversion.
  shares() {
    return Object.fromEntries(this.thrusters.map(({ name, minimum, maximum }) =>
      [`order_${name.split(".")[1]}`, [name, (value) => value / (value < 0 ? -minimum : maximum)]]));
  }
}
