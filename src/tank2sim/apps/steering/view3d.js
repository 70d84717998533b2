// The view from the bridge by three.js, in place of the chart. North is -z there, east x, up y.

class BridgeView {
  static FIELD = 60; // deg, width of the picture: own bow and a channel are in it (project choice)
  static FAR = 60; // ship lengths that are drawn
  // Heights and the place of the house, in ship lengths: those of a laden tanker, bridge aft (project choice).
  static DECK = 0.03;
  static HOUSE = { height: 0.11, from: -0.42, to: -0.36 };
  static BANK = 0.02;
  static BUOY = 0.03; // larger than they are, so that they are seen from a mile (project choice)
  // Where the eye is (ahead of amidships in lengths, to starboard in beams, above the water in lengths), and where it
  // looks (deg, clockwise from the bow, and upwards).
  static CAMERAS = {
    ahead: { name: "Bridge", ahead: -0.355, aside: 0, height: 0.115, turned: 0, up: -2 },
    port: { name: "Port wing", ahead: -0.355, aside: -0.5, height: 0.115, turned: -90, up: -4 },
    starboard: { name: "Starboard wing", ahead: -0.355, aside: 0.5, height: 0.115, turned: 90, up: -4 },
    above: { name: "Above", ahead: -3.2, aside: 0, height: 0.65, turned: 0, up: -7 },
  };
  static COLOUR = { sky: "#9cc4e6", haze: "#dbe8f1", sea: "#2c6a8f", crest: "#4484a8", grid: "#79aac4", deck: "#8c4a3c",
    house: "#f4f4f0" };

  // `context` is that of WebGL 2 of the canvas.
  constructor(canvas, context, { length, beam }, ghost, waters) {
    Object.assign(this, { canvas, length, beam, ghost, camera: "ahead" });
    this.renderer = new THREE.WebGLRenderer({ canvas, context, antialias: true });
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(BridgeView.COLOUR.sky);
    this.scene.fog = new THREE.Fog(BridgeView.COLOUR.haze, 5 * length, 0.9 * BridgeView.FAR * length);
    this.eye = new THREE.PerspectiveCamera(BridgeView.FIELD, 1, 0.005 * length, BridgeView.FAR * length);
    this.eye.rotation.order = "YXZ";
    const sun = new THREE.DirectionalLight("#ffffff", 0.6);
    sun.position.set(-1, 2, 1);
    this.scene.add(sun, new THREE.AmbientLight("#ffffff", 0.55));
    this.colour = colours(true);
    this.sea = this.#sea();
    this.outline = this.#outline();
    this.own = this.#ship(BridgeView.COLOUR.deck, BridgeView.COLOUR.house);
    this.other = ghost ? this.#ship(this.colour.other, this.colour.other) : null;
    this.members = [];
    if (waters) this.#waters(waters);
  }

  #add(geometry, colour) {
    const mesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ color: colour }));
    this.scene.add(mesh);
    return mesh;
  }

  // What lies on the water: before all that rises above it, one over the other from the lowest `order` (negative) on.
  #flat(object, order) {
    object.material.depthWrite = false;
    object.renderOrder = order;
    this.scene.add(object);
    return object;
  }

  // A square around the ship; its texture is fixed in the world, with squares of one ship length.
  #sea() {
    const [pen, size] = [document.createElement("canvas").getContext("2d"), 512];
    const { sea, crest, grid } = BridgeView.COLOUR;
    pen.canvas.width = pen.canvas.height = size;
    pen.fillStyle = sea;
    pen.fillRect(0, 0, size, size);
    pen.fillStyle = crest;
    for (let wave = 0; wave < 400; wave += 1) pen.fillRect(wave * 197 % size, wave * wave * 31 % size, 14, 2);
    pen.strokeStyle = grid;
    pen.lineWidth = 4;
    pen.strokeRect(0, 0, size, size);
    const texture = new THREE.CanvasTexture(pen.canvas);
    texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
    texture.repeat.setScalar(2 * BridgeView.FAR);
    texture.anisotropy = 8;
    const side = 2 * BridgeView.FAR * this.length;
    const material = new THREE.MeshBasicMaterial({ map: texture });
    return this.#flat(new THREE.Mesh(new THREE.PlaneGeometry(side, side).rotateX(-Math.PI / 2), material), -4);
  }

  // The hull as on the chart, seen from above: to starboard, ahead.
  #outline() {
    const [long, half] = [this.length, this.beam / 2];
    const shape = new THREE.Shape();
    shape.moveTo(0, long / 2);
    shape.quadraticCurveTo(half, long / 3, half, long / 6);
    shape.lineTo(half, -long / 2);
    shape.lineTo(-half, -long / 2);
    shape.lineTo(-half, long / 6);
    shape.quadraticCurveTo(-half, long / 3, 0, long / 2);
    return BridgeView.#raised(shape, BridgeView.DECK * long);
  }

  static #raised(shape, height) {
    return new THREE.ExtrudeGeometry(shape, { depth: height, bevelEnabled: false }).rotateX(-Math.PI / 2);
  }

  #ship(deck, house) {
    const { height, from, to } = BridgeView.HOUSE;
    const high = height - BridgeView.DECK;
    const hull = this.#add(this.outline, deck);
    const tower = new THREE.BoxGeometry(0.7 * this.beam, high * this.length, (to - from) * this.length);
    tower.translate(0, (BridgeView.DECK + high / 2) * this.length, -(from + to) / 2 * this.length);
    const wings = new THREE.BoxGeometry(this.beam, 0.2 * high * this.length, 0.3 * (to - from) * this.length);
    wings.translate(0, (height - 0.1 * high) * this.length, -(to - 0.15 * (to - from)) * this.length);
    hull.add(this.#add(tower, house), this.#add(wings, house));
    return hull;
  }

  static #shape(points) { return new THREE.Shape(points.map(([x, y]) => new THREE.Vector2(y, x))); }

  #area(points, colour, order, opacity = 1) {
    const geometry = new THREE.ShapeGeometry(BridgeView.#shape(points)).rotateX(-Math.PI / 2);
    const material = new THREE.MeshBasicMaterial({ color: colour, transparent: opacity < 1, opacity });
    this.#flat(new THREE.Mesh(geometry, material), order);
  }

  #line(points, colour) {
    const geometry = new THREE.BufferGeometry().setFromPoints(points.map(([x, y]) => new THREE.Vector3(y, 0, -x)));
    this.#flat(new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: colour })), -1);
  }

  #waters({ depths, banks, buoys, channel, goal, draught }) {
    for (const { points, depth_m: depth } of depths) if (depth < (draught ?? 0)) this.#area(points, this.colour.shoal, -3);
    for (const { points } of banks) {
      this.#add(BridgeView.#raised(BridgeView.#shape(points), BridgeView.BANK * this.length), this.colour.land);
    }
    if (goal) this.#area(goal.points, this.colour.ahead, -2, 0.5);
    if (channel) for (const side of [-1, 1]) this.#line(BridgeView.sideOf(channel, side), "#ffffff");
    const size = BridgeView.BUOY * this.length;
    const forms = {
      port: [new THREE.CylinderGeometry(size / 4, size / 4, size), this.colour.port],
      starboard: [new THREE.ConeGeometry(size / 3, size), this.colour.starboard],
    };
    for (const { points: [[x, y]], side } of buoys) {
      this.#add(...forms[side] ?? [new THREE.SphereGeometry(size / 2), this.colour.other]).position.set(y, size / 2, -x);
    }
  }

  // The side of a channel: -1 is that to port of its centre line, 1 that to starboard.
  static sideOf({ points, width_m: width }, side) {
    return points.map(([x, y], place) => {
      const [before, after] = [points[Math.max(0, place - 1)], points[Math.min(points.length - 1, place + 1)]];
      const [north, east] = [after[0] - before[0], after[1] - before[1]];
      const off = side * width / 2 / Math.hypot(north, east);
      return [x - east * off, y + north * off];
    });
  }

  static #put(object, x, y, psi) {
    object.position.set(y, 0, -x);
    object.rotation.y = -psi;
  }

  // Own ship, members and the measured trial where they are now, `width` and `height` px large.
  draw(own, members, width, height) {
    const [x, y, psi] = Voyage.POSE.map((name) => own.samples[name].at(-1));
    BridgeView.#put(this.own, x, y, psi);
    this.#drawMembers(members);
    if (this.other) this.#drawOther(own.time);
    this.sea.position.set(y, 0, -x);
    const part = (way) => way / this.length % 1;
    this.sea.material.map.offset.set(part(y), part(x));
    this.#look(x, y, psi, width / height);
    this.renderer.setPixelRatio(window.devicePixelRatio || 1);
    this.renderer.setSize(width, height);
    this.renderer.render(this.scene, this.eye);
  }

  // Members are edges of a hull, for at the start all are in the same place.
  #drawMembers(shown) {
    while (this.members.length < shown.length) {
      this.edges ??= new THREE.EdgesGeometry(this.outline, 30);
      const lines = new THREE.LineSegments(this.edges, new THREE.LineBasicMaterial());
      this.members.push(lines);
      this.scene.add(lines);
    }
    this.members.forEach((lines, number) => {
      lines.visible = number < shown.length;
      if (!lines.visible) return;
      const { aground, voyage } = shown[number];
      lines.material.color.set(aground ? this.colour.port : this.colour.paper);
      BridgeView.#put(lines, ...Voyage.POSE.map((name) => voyage.samples[name].at(-1)));
    });
  }

  #drawOther(time) {
    const row = Math.max(0, HistoryChart.place(this.ghost.t, time + 1e-6) - 1);
    const [x, y, psi] = [this.ghost.x[row], this.ghost.y[row], this.ghost.psi[row] ?? 0];
    this.other.visible = x !== null && y !== null;
    if (this.other.visible) BridgeView.#put(this.other, x, y, psi);
  }

  #look(x, y, psi, aspect) {
    const { ahead, aside, height, turned, up } = BridgeView.CAMERAS[this.camera];
    const [far, off] = [ahead * this.length, aside * this.beam];
    const [cosine, sine] = [Math.cos(psi), Math.sin(psi)];
    this.eye.position.set(y + far * sine + off * cosine, height * this.length, -(x + far * cosine - off * sine));
    this.eye.rotation.set(up * DEG, -(psi + turned * DEG), 0);
    this.eye.aspect = aspect;
    this.eye.fov = 2 / DEG * Math.atan(Math.tan(BridgeView.FIELD / 2 * DEG) / aspect);
    this.eye.updateProjectionMatrix();
    this.eye.updateMatrixWorld();
    this.bearing = course(psi + turned * DEG);
  }

  // Where a point, x north, y east and up (m), is seen: px from the left and from the top; null behind the eye.
  placeOf(x, y, up = 0) {
    const point = new THREE.Vector3(y, up, -x).applyMatrix4(this.eye.matrixWorldInverse);
    if (point.z >= 0) return null;
    point.applyMatrix4(this.eye.projectionMatrix);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    return [(1 + point.x) / 2 * width, (1 - point.y) / 2 * height];
  }
}

// The chart of the page, or the view from the bridge above it. On paper it is the chart.
TrackChart = class extends TrackChart {
  constructor(canvas, data, view, waters = null) {
    super(canvas, data, view, waters);
    this.data = data;
    const find = (name) => document.getElementById(name);
    [this.over, this.button, this.bearing] = ["bridge-view", "view-3d", "bearing"].map(find);
    this.cameras = [...document.querySelectorAll("[data-camera]")];
    this.button.addEventListener("click", () => this.#toggle());
    for (const one of this.cameras) one.addEventListener("click", () => this.#from(one.dataset.camera));
    document.addEventListener("keydown", (event) => this.#key(event));
  }

  draw(...what) {
    this.drawn = what;
    const [own, members, , paper] = what;
    if (this.over.hidden || paper) return super.draw(...what);
    const { offsetLeft, offsetTop, clientWidth, clientHeight } = this.canvas;
    Object.assign(this.over.style, { left: `${offsetLeft}px`, top: `${offsetTop}px` });
    Object.assign(this.bearing.style, { left: `${offsetLeft}px`, top: `${offsetTop + clientHeight}px` });
    this.bridge.draw(own, members, clientWidth, clientHeight);
    this.bearing.textContent = `${BridgeView.CAMERAS[this.bridge.camera].name} ${this.bridge.bearing}°`;
  }

  #toggle() {
    if (!this.bridge) {
      const context = this.over.getContext("webgl2");
      if (!context) {
        this.button.textContent = "3-D view: no WebGL here";
        return;
      }
      this.bridge = new BridgeView(this.over, context, this.data, this.ghost, this.waters);
      this.over.placeOf = (...point) => this.bridge.placeOf(...point);
    }
    this.over.hidden = !this.over.hidden;
    this.over.parentElement.classList.toggle("from-bridge", !this.over.hidden);
    this.button.textContent = this.over.hidden ? "3-D view" : "Chart";
    this.draw(...this.drawn);
  }

  #from(camera) {
    this.bridge.camera = camera;
    for (const one of this.cameras) one.setAttribute("aria-pressed", String(one.dataset.camera === camera));
    this.draw(...this.drawn);
  }

  #key({ key, target, ctrlKey, altKey, metaKey }) {
    if (ctrlKey || altKey || metaKey || target.matches("input[type=number], input[type=text], select")) return;
    if (key.toLowerCase() === "b") this.button.click();
    else if (!this.over.hidden) this.cameras[["1", "2", "3", "4"].indexOf(key)]?.click();
  }
};
