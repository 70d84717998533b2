// The waters of a scenario: where it is how deep, what a hull touches, and how they are drawn.

const inside = (points, x, y) => {
  let within = false;
  for (let here = 0, before = points.length - 1; here < points.length; before = here, here += 1) {
    const [[x0, y0], [x1, y1]] = [points[here], points[before]];
    if ((y0 > y) !== (y1 > y) && x < (x1 - x0) * (y - y0) / (y1 - y0) + x0) within = !within;
  }
  return within;
};

class Waters {
  // `draught` (m) is null where the card states none: then depths do not hold a ship up.
  constructor({ features }, { length, beam, draught }) {
    Object.assign(this, { length, beam, draught });
    const of = (kind) => features.filter((one) => one.kind === kind);
    [this.depths, this.banks, this.buoys] = [of("depth"), of("bank"), of("buoy")];
    [this.channel] = of("channel");
    [this.goal] = of("goal");
    for (const one of [...this.depths, ...this.banks]) one.box = Waters.box(one.points);
    // What the whole view shows; banks may reach far inland.
    const seen = [this.channel, this.goal, ...this.depths, ...this.buoys];
    this.corners = [[0, 0], ...seen.flatMap((one) => one?.points ?? [])];
  }

  static box(points) {
    const [xs, ys] = [points.map(([x]) => x), points.map(([, y]) => y)];
    return [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  }

  static holds({ points, box }, x, y) {
    return x >= box[0] && x <= box[1] && y >= box[2] && y <= box[3] && inside(points, x, y);
  }

  // Points of the hull at [x, y], heading psi: bow, shoulders, midships, quarters.
  hull(x, y, psi) {
    const [ahead, aside] = [this.length / 2, this.beam / 2];
    const [cosine, sine] = [Math.cos(psi), Math.sin(psi)];
    const points = [[ahead, 0], [ahead / 3, aside], [ahead / 3, -aside], [-ahead / 3, aside], [-ahead / 3, -aside],
      [-ahead, aside], [-ahead, -aside]];
    return points.map(([far, off]) => [x + far * cosine - off * sine, y + far * sine + off * cosine]);
  }

  depth(x, y) { return this.depths.findLast((one) => Waters.holds(one, x, y))?.depth_m ?? Infinity; }

  // What holds the hull up: "the bank", "the bottom" or null.
  aground(x, y, psi) {
    const points = this.hull(x, y, psi);
    if (this.banks.some((one) => points.some((point) => Waters.holds(one, ...point)))) return "the bank";
    if (this.draught === null) return null;
    return points.some((point) => this.depth(...point) < this.draught) ? "the bottom" : null;
  }

  // Numbers of the buoys within the hull.
  touched(x, y, psi) {
    const [cosine, sine] = [Math.cos(psi), Math.sin(psi)];
    const found = [];
    this.buoys.forEach(({ points: [[north, east]] }, number) => {
      const [far, off] = [(north - x) * cosine + (east - y) * sine, (east - y) * cosine - (north - x) * sine];
      if (Math.abs(far) <= this.length / 2 && Math.abs(off) <= this.beam / 2) found.push(number);
    });
    return found;
  }

  // Distance (m, + to starboard) off the centre line, and along it; null without one, and beyond its ends.
  offCentre(x, y) {
    let [best, along, before] = [null, 0, 0];
    const points = this.channel?.points ?? [];
    for (let place = 0; place + 1 < points.length; place += 1) {
      const [[x0, y0], [x1, y1]] = [points[place], points[place + 1]];
      const long = Math.hypot(x1 - x0, y1 - y0);
      const [north, east] = [(x1 - x0) / long, (y1 - y0) / long];
      const far = (x - x0) * north + (y - y0) * east;
      const kept = Math.max(0, Math.min(long, far));
      const apart = Math.hypot(x - x0 - kept * north, y - y0 - kept * east);
      const off = ((y - y0) * north - (x - x0) * east) < 0 ? -apart : apart;
      if (best === null || apart < Math.abs(best)) {
        const beyond = (place === 0 && far < 0) || (place + 2 === points.length && far > long);
        [best, along] = [off, beyond ? null : before + kept];
      }
      before += long;
    }
    return best === null || along === null ? null : { off: best, along };
  }

  // Whether the ship has come to the goal: within it, slow enough, with its heading.
  arrived(x, y, psi, speed) {
    if (!this.goal || !inside(this.goal.points, x, y)) return false;
    const { heading_rad: heading, within_rad: most = Math.PI / 18, speed_mps: fastest = Infinity } = this.goal;
    return speed <= fastest && (heading === undefined || Math.abs(HistoryChart.wrapped(psi - heading)) <= most / DEG);
  }

  #shape(pen, at, points) {
    pen.beginPath();
    points.forEach(([x, y], place) => { if (place) pen.lineTo(...at(x, y)); else pen.moveTo(...at(x, y)); });
  }

  // Areas below the grid.
  areas(pen, colour, at) {
    const { deep, little, shoal, land } = colour;
    const draught = this.draught ?? 0;
    for (const { points, depth_m: depth } of this.depths) {
      this.#shape(pen, at, points);
      pen.fillStyle = depth < draught ? shoal : depth < Waters.LITTLE * draught ? little : deep;
      pen.fill();
    }
    for (const { points } of this.banks) {
      this.#shape(pen, at, points);
      pen.fillStyle = land;
      pen.fill();
    }
  }

  static LITTLE = 1.5; // depths over draught below which water is drawn as shallow: MSC.137(76) asks for 4 in trials

  // Channel, goal and buoys above the grid; port is red and starboard green, as in region A of IALA.
  marks(pen, colour, at, scale) {
    if (this.channel) {
      line(pen, this.channel.points.length, (row) => at(...this.channel.points[row]),
        { colour: colour.muted, width: 1, dash: [10, 6] });
    }
    if (this.goal) {
      this.#shape(pen, at, this.goal.points);
      Object.assign(pen, { strokeStyle: colour.ahead, lineWidth: 2 });
      pen.setLineDash([3, 3]);
      pen.stroke();
      pen.setLineDash([]);
    }
    const size = Math.max(3.5, Math.min(6, 12 * scale));
    for (const { points: [[x, y]], side } of this.buoys) {
      pen.fillStyle = side === "port" ? colour.port : side === "starboard" ? colour.starboard : colour.other;
      const [left, top] = at(x, y);
      pen.beginPath();
      if (side === "starboard") {
        pen.moveTo(left, top - size * 1.3);
        pen.lineTo(left + size, top + size * 0.7);
        pen.lineTo(left - size, top + size * 0.7);
        pen.closePath();
      } else if (side === "port") pen.rect(left - size * 0.8, top - size * 0.8, size * 1.6, size * 1.6);
      else pen.arc(left, top, size * 0.8, 0, 2 * Math.PI);
      pen.fill();
    }
  }
}
