// Which part of the water the chart shows: the ship followed, the whole track, or where a hand has moved it.

class View {
  static FIRST = 12; // ship lengths across the chart at first: a turning circle and its surroundings
  static CLOSEST = 2; // ship lengths across the chart
  static FARTHEST = 400;
  static STEP = 1.25; // by which a key or a button zooms

  constructor(length) {
    this.length = length;
    this.span = View.FIRST * length; // m across the shorter side
    this.mode = "follow"; // "whole" and "free" are the others
    this.centre = [0, 0]; // north, east (m), when free
  }

  follow() {
    if (this.mode === "whole") this.span = View.FIRST * this.length;
    this.mode = "follow";
  }

  whole() { this.mode = "whole"; }

  // Closer by `factor`; the place at [north, east] stays where it is, unless the ship is followed.
  zoom(factor, place = null) {
    if (this.mode === "whole") { this.mode = "free"; this.centre = this.shown.centre; this.span = this.shown.span; }
    const before = this.span;
    this.span = Math.min(View.FARTHEST * this.length, Math.max(View.CLOSEST * this.length, before / factor));
    if (this.mode !== "free" || !place) return;
    const kept = this.span / before;
    this.centre = this.centre.map((one, axis) => place[axis] + (one - place[axis]) * kept);
  }

  // Moved by px on the screen.
  pan(right, down) {
    if (this.mode !== "free") { this.centre = this.shown.centre; this.span = this.shown.span; }
    this.mode = "free";
    this.centre = [this.centre[0] + down / this.shown.scale, this.centre[1] - right / this.shown.scale];
  }

  // Middle, px per m and m across the shorter side of `box`; `ship` is [north, east], `bounds` those of the track.
  within(box, ship, bounds) {
    const least = View.FIRST * this.length;
    const wide = (span) => Math.max(least, span * 1.16);
    const shorter = Math.min(box.across, box.up);
    let [centre, scale] = [this.mode === "follow" ? ship : this.centre, shorter / this.span];
    if (this.mode === "whole") {
      centre = [(bounds.north + bounds.south) / 2, (bounds.east + bounds.west) / 2];
      scale = Math.min(box.across / wide(bounds.east - bounds.west), box.up / wide(bounds.north - bounds.south));
    }
    this.shown = { centre, scale, span: shorter / scale, box };
    return this.shown;
  }

  // North and east (m) of a point of the canvas.
  place(left, top) {
    const { centre, scale, box } = this.shown;
    return [centre[0] - (top - box.top - box.up / 2) / scale, centre[1] + (left - box.left - box.across / 2) / scale];
  }
}

// Wheel, drag and pinch on a canvas move a view; `changed` is called after each. One finger scrolls the page.
function moveByHand(canvas, view, changed) {
  const down = new Map(); // pointers on the canvas
  const place = (event) => {
    const { left, top } = canvas.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  };
  const middle = () => [...down.values()].reduce((sum, one) => [sum[0] + one[0], sum[1] + one[1]], [0, 0])
    .map((one) => one / down.size);
  const spread = () => {
    const [first, second] = [...down.values()];
    return second ? Math.hypot(first[0] - second[0], first[1] - second[1]) : 0;
  };
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    view.zoom(View.STEP ** -Math.sign(event.deltaY), view.place(...place(event)));
    changed();
  }, { passive: false });
  canvas.addEventListener("pointerdown", (event) => {
    down.set(event.pointerId, place(event));
    canvas.setPointerCapture?.(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!down.has(event.pointerId)) return;
    const [before, apart] = [middle(), spread()];
    down.set(event.pointerId, place(event));
    if (event.pointerType === "touch" && down.size < 2) return;
    const [now, after] = [middle(), spread()];
    if (Math.hypot(now[0] - before[0], now[1] - before[1]) > 0 && (view.mode !== "follow" || down.size < 2)) {
      view.pan(now[0] - before[0], now[1] - before[1]);
    }
    if (apart > 0 && after > 0) view.zoom(after / apart, view.place(...now));
    changed();
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, (event) => down.delete(event.pointerId));
  }
}
