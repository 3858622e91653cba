"use strict";
// The scene of a flight: path, vehicle, scenery. Everything lies in one group whose axes are north, east, down [m], the
// vehicle in one whose axes are forward, right, down; three.js itself looks at east, north, up.

const SPAN = 0.55, HINGE = -0.035, TRAILING_EDGE = -0.08; // of the vehicle that is drawn, DarkO [m]
const PROPELLERS = [-0.16, 0.16], PROPELLER_AHEAD = 0.1, DISC_RADIUS = 0.075; // left, right [m]
const ARROW_PER_NEWTON = 0.09, ARROW_PER_WIND = 0.07; // lengths [m/N], [s]
const FULL_DEFLECTION = 0.52; // at which an elevon is drawn red [rad]
const LEAST_WIND = 0.3; // that is drawn and told [m/s]
const LEAST_SHARE = 0.075; // of the distance to the camera that the vehicle's span is drawn with
const MAX_GHOSTS = 500, MAX_LABELS = 60, LINE_WIDTH = 3; // the last one in pixels
const INK = { good: "#00916a", planned: "#0a7fc2", target: "#bf5f95", warning: "#c97a00", danger: "#e0313f",
  grey: "#808080", wind: "#1d8f9b", top: "#e8ecef", belly: "#2f6fa8" }; // meanings as in the terminal

function planform(corners, thickness) {
  const shape = new THREE.Shape(corners.map(([x, y]) => new THREE.Vector2(x, y)));
  const solid = new THREE.ExtrudeGeometry(shape, { depth: thickness, bevelEnabled: false });
  return solid.translate(0, 0, -thickness / 2);
}

const wingShape = (thickness) => planform(
  [[0.085, 0], [0.03, SPAN / 2], [HINGE, SPAN / 2], [HINGE, -SPAN / 2], [0.03, -SPAN / 2]], thickness);
const material = (color, more = {}) => new THREE.MeshLambertMaterial({ color, side: THREE.DoubleSide, ...more });

// An arrow along +x of unit length, whose shaft keeps its width.
class Arrow extends THREE.Group {
  constructor(color, radius) {
    super();
    const along = (geometry) => geometry.rotateZ(-Math.PI / 2);
    const look = material(color, { emissive: color, emissiveIntensity: 0.7 });
    this.shaft = new THREE.Mesh(along(new THREE.CylinderGeometry(radius, radius, 1, 12)).translate(0.5, 0, 0), look);
    this.head = new THREE.Mesh(along(new THREE.ConeGeometry(2.6 * radius, 6 * radius, 16)), look);
    this.tip = 3 * radius;
    this.add(this.shaft, this.head);
  }

  set length(length) {
    this.visible = length > 0.01;
    this.shaft.scale.x = Math.max(length, 0.01);
    this.head.position.x = length + this.tip;
  }
}

// Flying wing with two propellers and two elevons; pairs are left, right.
class Vehicle extends THREE.Group {
  constructor() {
    super();
    const wing = new THREE.Mesh(wingShape(0.014), material(INK.top));
    const belly = new THREE.Mesh(wingShape(0.004).translate(0, 0, 0.009), material(INK.belly));
    const body = new THREE.Mesh(new THREE.SphereGeometry(1, 24, 16).scale(0.1, 0.032, 0.026), material("#5b6670"));
    this.add(wing, belly, body);
    this.thrusts = PROPELLERS.map((y) => this.#propeller(y));
    this.elevons = PROPELLERS.map((y) => this.#elevon(Math.sign(y)));
  }

  #propeller(y) {
    const pod = new THREE.Mesh(new THREE.CylinderGeometry(0.014, 0.014, 0.09, 12).rotateZ(Math.PI / 2), material("#5b6670"));
    pod.position.set(PROPELLER_AHEAD - 0.045, y, 0);
    const glass = { transparent: true, opacity: 0.35, depthWrite: false };
    const disc = new THREE.Mesh(new THREE.CircleGeometry(DISC_RADIUS, 32).rotateY(Math.PI / 2), material("#9aa6b0", glass));
    disc.position.set(PROPELLER_AHEAD, y, 0);
    const thrust = new Arrow(INK.warning, 0.008);
    thrust.position.copy(disc.position);
    thrust.length = 0;
    this.add(pod, disc, thrust);
    return thrust;
  }

  #elevon(side) {
    const edge = TRAILING_EDGE - HINGE, inner = side * 0.03, outer = side * (SPAN / 2 - 0.004);
    const flap = new THREE.Mesh(planform([[0, inner], [0, outer], [edge, outer], [edge, inner]], 0.01), material(INK.top));
    flap.position.x = HINGE;
    this.add(flap);
    return flap;
  }

  // Thrusts [N] and deflections [rad], positive nose-up: the trailing edge goes to -z.
  act(thrusts, deflections) {
    this.thrusts.forEach((arrow, k) => { arrow.length = (thrusts[k] ?? 0) * ARROW_PER_NEWTON; });
    this.elevons.forEach((flap, k) => {
      const angle = deflections[k] ?? 0;
      flap.rotation.y = -angle;
      flap.material.color.set(INK.top).lerp(new THREE.Color(INK.danger), Math.min(Math.abs(angle) / FULL_DEFLECTION, 1));
    });
  }
}

function drawn(canvas, more) {
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = "srgb";
  return new THREE.Sprite(new THREE.SpriteMaterial({ map, sizeAttenuation: false, ...more }));
}

// A word that keeps its size on the screen.
function label(text, color) {
  const canvas = document.createElement("canvas"), pen = canvas.getContext("2d");
  const font = "600 28px system-ui, sans-serif";
  pen.font = font;
  canvas.width = Math.ceil(pen.measureText(text).width) + 16;
  canvas.height = 40;
  pen.font = font;
  pen.fillStyle = color;
  pen.textBaseline = "middle";
  pen.fillText(text, 8, 20);
  const sprite = drawn(canvas, { depthTest: false });
  sprite.center.set(0, 0);
  sprite.scale.set(canvas.width / 1400, canvas.height / 1400, 1);
  return sprite;
}

const dots = new Map(); // by colour: a flight may have a thousand

function dot(color, size) {
  if (!dots.has(color)) {
    const canvas = document.createElement("canvas"), pen = canvas.getContext("2d");
    canvas.width = canvas.height = 32;
    pen.fillStyle = color;
    pen.arc(16, 16, 14, 0, 2 * Math.PI);
    pen.fill();
    dots.set(color, drawn(canvas).material);
  }
  const sprite = new THREE.Sprite(dots.get(color));
  sprite.scale.set(size, size, 1);
  return sprite;
}

function fatLine(color, more) {
  const look = color === null ? { vertexColors: true } : { color };
  const line = new THREE.LineSegments2(new THREE.LineSegmentsGeometry(),
    new THREE.LineMaterial({ linewidth: LINE_WIDTH, transparent: true, ...look, ...more }));
  line.frustumCulled = false;
  line.visible = false;
  return line;
}

function setSegments(line, places, colors) {
  const old = line.geometry;
  line.visible = places.length > 0;
  if (!line.visible) return;
  line.geometry = new THREE.LineSegmentsGeometry().setPositions(places);
  if (colors) line.geometry.setColors(colors);
  old.dispose();
}

class FlightScene {
  constructor(canvasParent) {
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    canvasParent.prepend(this.renderer.domElement);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(45, 1, 0.05, 20000);
    this.camera.up.set(0, 0, 1);
    this.controls = new THREE.OrbitControls(this.camera, this.renderer.domElement);
    const sun = new THREE.DirectionalLight("#ffffff", 1.6);
    sun.position.set(-0.4, -0.7, 1);
    this.scene.add(new THREE.HemisphereLight("#ffffff", "#a4adb6", 2.3), sun);
    this.world = new THREE.Group(); // north, east, down
    this.world.quaternion.set(Math.SQRT1_2, Math.SQRT1_2, 0, 0);
    this.scene.add(this.world);
    this.vehicle = new Vehicle();
    this.vehicle.rotation.order = "ZYX";
    this.ahead = fatLine(null, { opacity: 0.3 });
    this.flown = fatLine(null, {});
    this.truth = fatLine(INK.grey, { linewidth: 1 });
    const plumb = new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3(0, 0, 1)]);
    this.drop = new THREE.Line(plumb, new THREE.LineBasicMaterial({ color: INK.grey })); // down to the ground
    this.target = dot(INK.target, 0.016);
    this.wind = new Arrow(INK.wind, 0.012);
    this.still = new THREE.Group(); // what does not move: ground, scenery, marks
    this.world.add(this.vehicle, this.ahead, this.flown, this.truth, this.drop, this.target, this.wind, this.still);
    this.ghosts = new THREE.InstancedMesh(wingShape(0.012),
      material("#ffffff", { transparent: true, opacity: 0.45, depthWrite: false }), MAX_GHOSTS);
    this.ghosts.count = 0;
    this.ghosts.frustumCulled = false;
    this.world.add(this.ghosts);
    this.labels = [];
    this.scale = 1;
  }

  resize(width, height) {
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.renderer.setSize(width, height);
  }

  // The path: places (flat) and a colour for each; null where nothing was recorded.
  setPath(places, colors) {
    const points = [], inks = [];
    this.segmentOf = new Int32Array(places.length / 3); // how many segments there are up to each sample
    const color = new THREE.Color();
    for (let k = 1; 3 * k < places.length; k++) {
      const from = places.slice(3 * k - 3, 3 * k), to = places.slice(3 * k, 3 * k + 3);
      if (!from.includes(null) && !to.includes(null)) {
        points.push(...from, ...to);
        color.set(colors[k - 1]);
        inks.push(color.r, color.g, color.b, color.r, color.g, color.b);
      }
      this.segmentOf[k] = points.length / 6;
    }
    setSegments(this.ahead, points, inks);
    setSegments(this.flown, points, inks);
  }

  setTruth(places) {
    const points = [];
    for (let k = 3; k + 2 < places.length; k += 6) points.push(...places.slice(k - 3, k + 3));
    setSegments(this.truth, points.includes(null) ? [] : points);
  }

  // Ground, scenery, home, waypoints and marks: {seen: {low, high}, scenery, home, waypoints, marks: [place, label, kind]}.
  setStill({ seen, scenery, home, waypoints, marks }) {
    this.still.clear();
    this.labels = [];
    const width = Math.max(seen.high[0] - seen.low[0], seen.high[1] - seen.low[1], 4) * 1.5;
    const cell = [0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 5000].find((size) => width / size <= 30) ?? 20000;
    const cells = Math.max(2 * Math.ceil(width / cell / 2), 4);
    const grid = new THREE.GridHelper(cells * cell, cells, INK.grey, INK.grey);
    grid.material.transparent = true;
    grid.material.opacity = 0.35;
    grid.rotation.x = Math.PI / 2;
    const middle = (axis) => cell * Math.round((seen.low[axis] + seen.high[axis]) / 2 / cell);
    grid.position.set(middle(0), middle(1), home ? home[2] : 0);
    this.still.add(grid);
    this.cell = cell;
    for (const prism of scenery) this.#addPrism(prism);
    if (home) this.#addMark(home, "home", INK.good, 0.014);
    for (const [number, place] of waypoints) this.#addMark(place, String(number), INK.planned, 0.014);
    for (const [place, words, color] of marks) this.#addMark(place, words, color, 0.011);
  }

  #addMark(place, words, color, size) {
    const mark = dot(color, size);
    mark.position.set(...place);
    this.still.add(mark);
    if (this.labels.length >= MAX_LABELS) return;
    const text = label(words, color);
    text.position.set(...place);
    this.still.add(text);
    this.labels.push(text);
  }

  #addPrism({ corners, bottom, top, hollow }) {
    const shape = new THREE.Shape(corners.map(([north, east]) => new THREE.Vector2(north, east)));
    const solid = new THREE.ExtrudeGeometry(shape, { depth: top - bottom, bevelEnabled: false }).translate(0, 0, -top);
    this.still.add(new THREE.LineSegments(new THREE.EdgesGeometry(solid, 30), new THREE.LineBasicMaterial({ color: INK.grey })));
    if (!hollow) this.still.add(new THREE.Mesh(solid, material(INK.grey, { transparent: true, opacity: 0.25, depthWrite: false })));
  }

  // The vehicle where it is: null for what is not known. Places are NED, the quaternion is (w, x, y, z).
  setVehicle({ place, attitude, thrust, elevon, wind, target, ground, sample }) {
    this.vehicle.visible = place !== null;
    this.target.visible = target !== null;
    if (target) this.target.position.set(...target);
    this.flown.geometry.instanceCount = this.segmentOf?.[sample] ?? 0;
    this.drop.visible = this.wind.visible = false;
    if (!place) return;
    this.vehicle.position.set(...place);
    if (attitude) this.vehicle.quaternion.set(attitude[1], attitude[2], attitude[3], attitude[0]);
    this.vehicle.act(thrust, elevon);
    this.drop.visible = ground > place[2];
    this.drop.position.copy(this.vehicle.position);
    this.drop.scale.z = ground - place[2];
    this.#setWind(wind);
  }

  // It blows towards the vehicle.
  #setWind(wind) {
    const speed = wind ? Math.hypot(...wind) : 0;
    if (speed < LEAST_WIND) return;
    const along = new THREE.Vector3(...wind).normalize();
    this.wind.length = speed * ARROW_PER_WIND;
    this.wind.quaternion.setFromUnitVectors(new THREE.Vector3(1, 0, 0), along);
    this.wind.position.copy(this.vehicle.position).addScaledVector(along, -(0.5 + speed * ARROW_PER_WIND) * this.scale);
    this.wind.scale.setScalar(this.scale);
  }

  // What is far away is drawn larger than it is: it must be seen. Returns whether the size changed much.
  fitSize() {
    const distance = this.camera.position.distanceTo(this.vehicle.getWorldPosition(new THREE.Vector3()));
    this.scale = Math.max(1, (LEAST_SHARE * distance) / SPAN);
    this.vehicle.scale.setScalar(this.scale);
    const changed = this.scale > 1.3 * this.ghostScale || this.scale < this.ghostScale / 1.3;
    if (changed) this.#placeGhosts();
    return changed;
  }

  setPoses(poses) { // [place, attitude, colour] along the path
    this.poses = poses;
    this.#placeGhosts();
  }

  // The vehicle's attitude along the path, as often as the copies do not cover each other.
  #placeGhosts() {
    this.ghostScale = this.scale;
    let count = 0, last = null;
    const pose = new THREE.Object3D(), color = new THREE.Color();
    pose.scale.setScalar(this.scale);
    for (const [place, attitude, ink] of this.poses ?? []) {
      if (count === MAX_GHOSTS) break;
      if (last && Math.hypot(place[0] - last[0], place[1] - last[1], place[2] - last[2]) < 0.8 * SPAN * this.scale) continue;
      last = place;
      pose.position.set(...place);
      pose.quaternion.set(attitude[1], attitude[2], attitude[3], attitude[0]);
      pose.updateMatrix();
      this.ghosts.setMatrixAt(count, pose.matrix);
      this.ghosts.setColorAt(count++, color.set(ink));
    }
    this.ghosts.count = count;
    this.ghosts.instanceMatrix.needsUpdate = true;
    if (this.ghosts.instanceColor) this.ghosts.instanceColor.needsUpdate = true;
  }

  // Labels that would cover an earlier one are hidden.
  #spreadLabels() {
    const size = this.renderer.getSize(new THREE.Vector2()), taken = [];
    for (const text of this.labels) {
      const at = text.getWorldPosition(new THREE.Vector3()).project(this.camera);
      const box = { x: (at.x * size.x) / 2, y: (at.y * size.y) / 2, wide: text.scale.x * size.y * 1.2, high: text.scale.y * size.y * 1.2 };
      text.visible = at.z < 1 && !taken.some((other) =>
        box.x < other.x + other.wide && other.x < box.x + box.wide && Math.abs(box.y - other.y) < box.high);
      if (text.visible) taken.push(box);
    }
  }

  draw() {
    this.camera.updateMatrixWorld();
    this.#spreadLabels();
    this.renderer.render(this.scene, this.camera);
  }
}
