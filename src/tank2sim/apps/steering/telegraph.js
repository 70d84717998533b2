// The engine telegraph: a button for each order, from full astern to full sea speed.

class Telegraph {
  // `orders` are {name, value (rad/s)}, rising; `given` is called with a value.
  constructor(place, orders, given) {
    Object.assign(this, { orders, given });
    this.buttons = orders.map((one, number) => place.querySelector(`[data-order="${number}"]`));
    this.buttons.forEach((button, number) => button.addEventListener("click", () => given(orders[number].value)));
  }

  // The order nearest to a value, and whether it is that order.
  nearest(value) {
    const far = this.orders.map((one) => Math.abs(one.value - value));
    const number = far.indexOf(Math.min(...far));
    return { number, exact: far[number] < 1e-9 };
  }

  // One order ahead (1) or astern (-1) of `value`: from between two orders to the next of them.
  step(by, value) {
    const beyond = this.orders.filter((one) => (one.value - value) * by > 1e-9);
    const next = by > 0 ? beyond[0] : beyond.at(-1);
    if (next) this.given(next.value);
  }

  show(value) {
    const { number, exact } = this.nearest(value);
    this.buttons.forEach((button, place) => {
      const pressed = String(exact && place === number);
      if (button.getAttribute("aria-pressed") !== pressed) button.setAttribute("aria-pressed", pressed);
    });
  }
}
