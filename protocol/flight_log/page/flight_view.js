"use strict";
// A flight that is played: the clock, what the scene shows at it, and what one steers it with.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];
const CLOSE = 2.8; // of the camera that follows the vehicle [m]
const SPEED_WINDOW = 0.2; // either way, over which the speed is told [s]
const MAX_LIVE = 12000; // samples of a live flight that are kept: ten minutes
const LIVE_PATH_PERIOD = 0.5; // in which the path of a live flight is drawn anew [s]
const RESTART = 1; // back, after which the vehicle has restarted [s]
const degrees = (angle) => `${Math.round(angle * 180 / Math.PI) || 0}°`; // without a -0
const PANEL = `
  <div class="stage"><output class="readings"></output></div>
  <div class="bar">
    <button type="button" data-do="play" title="Play, pause (Space)">▶</button>
    <button type="button" data-do="back" title="The jump before (Shift+Left)">‹ jump</button>
    <button type="button" data-do="next" title="The next jump (Shift+Right)">jump ›</button>
    <label>speed <select data-do="speed">${SPEEDS.map((s) => `<option value="${s}"${s === 1 ? " selected" : ""}>${s}×</option>`).join("")}</select></label>
    <label>camera <select data-do="camera"><option value="follow">follows</option><option value="side">beside</option>
      <option value="orbit">whole path</option></select></label>
    <label><input type="checkbox" data-do="ghosts" checked> attitudes</label>
    <button type="button" data-do="pin" title="Keep it in sight beside the charts">pin</button>
    <button type="button" data-do="picture" title="Save a picture">picture</button>
  </div>
  <div class="track"><canvas height="1"></canvas><input type="range" min="0" max="1" step="any" value="0" aria-label="time"></div>`;

class FlightView {
  constructor(root) {
    this.root = root;
    root.classList.add("flight-view");
    root.innerHTML = PANEL;
    this.stage = root.querySelector(".stage");
    this.scene = new FlightScene(this.stage); // throws without WebGL
    this.slider = root.querySelector("input[type=range]");
    this.onTime = () => {};
    this.times = [];
    this.isPlaying = this.isLive = false;
    this.speed = 1;
    this.mode = "follow";
    this.#listen();
    new ResizeObserver(() => this.#resize()).observe(this.stage);
    this.#resize();
  }

  // A whole flight, as ``flight_motion`` has it.
  load(motion) {
    Object.assign(this, motion);
    this.times = Array.from({ length: motion.position.length / 3 }, (_, k) => motion.start + k * motion.step);
    [this.slider.min, this.slider.max] = [this.times[0], this.times.at(-1)];
    this.scene.setTruth(motion.truth);
    this.#drawPath();
    this.#drawStill();
    this.#drawTrack();
    this.seek(this.times[0]);
    this.look("orbit");
  }

  // The newest sample of a live flight: {time, place, attitude, thrust, elevon, law: [label, colour], wind, target, home, waypoints}.
  append(now) {
    if (!this.times.length || now.time < this.times.at(-1) - RESTART) this.#begin(now);
    if (now.time <= this.times.at(-1)) return;
    this.times.push(now.time);
    this.position.push(...(now.place ?? [null, null, null]));
    this.attitude.push(...(now.attitude ?? [null, null, null, null]));
    this.thrust.push(...(now.thrust.length ? now.thrust : [null, null]));
    this.elevon.push(...(now.elevon.length ? now.elevon : [null, null]));
    if (this.laws.at(-1)?.[1] !== now.law[0]) {
      if (this.laws.length) this.marks.push([now.time, now.law[0], now.law[0], "jump"]);
      this.laws.push([now.time, ...now.law]);
    }
    for (const [series, value] of [[this.wind, now.wind], [this.target, now.target]])
      if (value) { series.times.push(now.time); series.values.push(...value); }
    if (this.times.length > MAX_LIVE) this.#forget(MAX_LIVE / 4);
    [this.slider.min, this.slider.max] = [this.times[0], now.time];
    if (now.time - this.drawnUntil > LIVE_PATH_PERIOD || this.times.length <= 2) this.#drawLive(now);
    if (this.isLive) this.#show(now.time);
  }

  #begin(now) {
    Object.assign(this, { times: [], position: [], attitude: [], thrust: [], elevon: [], laws: [], marks: [], scenery: [],
      wind: { times: [], values: [] }, target: { times: [], values: [] }, home: null, waypoints: [], isLive: true });
    this.drawnUntil = now.time;
    this.look("follow");
  }

  #forget(count) {
    this.times.splice(0, count);
    this.position.splice(0, 3 * count);
    this.attitude.splice(0, 4 * count);
    this.thrust.splice(0, 2 * count);
    this.elevon.splice(0, 2 * count);
  }

  #drawLive(now) {
    this.drawnUntil = now.time;
    [this.home, this.waypoints] = [now.home, now.waypoints];
    this.#drawPath();
    const still = JSON.stringify([now.home, now.waypoints, this.marks.length, this.#seen().high.map((x) => Math.ceil(x / 20))]);
    if (still !== this.drawnStill) this.#drawStill();
    this.drawnStill = still;
    this.#drawTrack();
  }

  #drawPath() {
    const colors = this.times.map((time) => this.lawAt(time)[2]);
    this.scene.setPath(this.position, colors);
    const poses = [];
    for (let k = 0; k < this.times.length; k++) {
      const place = this.position.slice(3 * k, 3 * k + 3), attitude = this.attitude.slice(4 * k, 4 * k + 4);
      if (!place.includes(null) && !attitude.includes(null)) poses.push([place, attitude, colors[k]]);
    }
    this.scene.setPoses(poses);
  }

  #seen() {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    const take = (place) => place.forEach((x, k) => { low[k] = Math.min(low[k], x); high[k] = Math.max(high[k], x); });
    for (let k = 0; k < this.position.length; k += 3) if (this.position[k] !== null) take(this.position.slice(k, k + 3));
    for (const [, place] of this.waypoints) take(place);
    return { low, high };
  }

  #drawStill() {
    const colorOf = (words) => this.laws.find(([, law]) => law === words)?.[2] ?? INK.grey; // a jump is named by its law
    const marks = this.marks.filter(([, , , kind]) => kind === "jump" || kind === "alarm").map(([time, words, , kind]) =>
      [this.#at(time).place, words, kind === "alarm" ? INK.danger : colorOf(words)]).filter(([place]) => place);
    this.scene.setStill({ seen: this.#seen(), scenery: this.scenery, home: this.home, waypoints: this.waypoints, marks });
  }

  // The laws in force as colours below the slider, the jumps as gaps between them.
  #drawTrack() {
    const canvas = this.root.querySelector(".track canvas"), pen = canvas.getContext("2d");
    canvas.width = 1200;
    const x = (time) => ((time - this.times[0]) / (this.times.at(-1) - this.times[0] || 1)) * canvas.width;
    this.laws.forEach(([time, , color], k) => {
      pen.fillStyle = color;
      pen.fillRect(x(time) + 1, 0, x(this.laws[k + 1]?.[0] ?? this.times.at(-1)) - x(time) - 1, 1);
    });
  }

  lawAt(time) {
    let found = this.laws[0] ?? [0, "", INK.grey];
    for (const law of this.laws) { if (law[0] > time) break; found = law; }
    return found;
  }

  // The state at a time: in between in proportion, null where nothing was recorded.
  #at(time) {
    const times = this.times;
    let low = 0, high = times.length - 1;
    while (high - low > 1) { const middle = (low + high) >> 1; if (times[middle] <= time) low = middle; else high = middle; }
    const share = Math.min(Math.max((time - times[low]) / (times[high] - times[low] || 1), 0), 1);
    const mixed = (values, size) => {
      const [from, to] = [low, high].map((k) => values.slice(size * k, size * k + size));
      if (!from.length || from.includes(null)) return null;
      return to.includes(null) ? from : from.map((value, k) => value + share * (to[k] - value));
    };
    const turned = mixed(this.attitude, 4), length = turned && Math.hypot(...turned);
    return { sample: low, place: mixed(this.position, 3), attitude: turned?.map((part) => part / length) ?? null,
      thrust: mixed(this.thrust, 2) ?? [], elevon: mixed(this.elevon, 2) ?? [], wind: this.#last(this.wind, time),
      target: this.#last(this.target, time) };
  }

  #last({ times, values }, time) {
    let k = times.length - 1;
    while (k > 0 && times[k] > time) k--;
    const value = values.slice(3 * k, 3 * k + 3);
    return k < 0 || value.includes(null) ? null : value;
  }

  seek(time) {
    this.isLive = false;
    this.#show(Math.min(Math.max(time, this.times[0]), this.times.at(-1)));
  }

  #show(time) {
    this.time = time;
    const state = this.#at(time), place = this.scene.vehicle.position.clone();
    this.scene.setVehicle({ ...state, ground: this.home?.[2] ?? 0 });
    if (this.mode !== "orbit" && state.place) this.#carryCamera(place);
    this.#tell(state);
    this.slider.value = time;
    this.root.dataset.time = time.toFixed(2);
    this.onTime(time);
    this.draw();
  }

  #carryCamera(before) {
    const shift = this.scene.vehicle.position.clone().sub(before).applyQuaternion(this.scene.world.quaternion);
    this.scene.camera.position.add(shift);
    this.scene.controls.target.add(shift);
    if (this.mode === "side") this.#standBeside();
  }

  // Across the way that the vehicle flies, a little behind it: so its pitch and its elevons are seen.
  #standBeside() {
    const velocity = this.#velocity(this.time), { camera, controls } = this.scene;
    if (!velocity || Math.hypot(velocity[0], velocity[1]) < 0.5) return;
    const level = Math.hypot(velocity[0], velocity[1]), distance = camera.position.distanceTo(controls.target);
    const [north, east] = velocity.map((part) => part / level);
    const aside = new THREE.Vector3(-east - 0.55 * north, north - 0.55 * east, -0.4).setLength(distance);
    const goal = controls.target.clone().add(aside.applyQuaternion(this.scene.world.quaternion));
    camera.position.lerp(goal, 0.08).sub(controls.target).setLength(distance).add(controls.target);
    controls.update();
  }

  #velocity(time) {
    const from = Math.max(time - SPEED_WINDOW, this.times[0]), to = Math.min(time + SPEED_WINDOW, this.times.at(-1));
    const [before, after] = [this.#at(from).place, this.#at(to).place];
    return before && after && to > from ? after.map((x, k) => (x - before[k]) / (to - from)) : null;
  }

  #tell({ place, attitude, thrust, elevon, wind }) {
    const [, law, color] = this.lawAt(this.time), velocity = this.#velocity(this.time), lines = [];
    lines.push([`${this.time.toFixed(2)} s  ${law}`, color]);
    if (place) lines.push([`height ${((this.home?.[2] ?? 0) - place[2]).toFixed(1)} m` + (velocity ? `  ${Math.hypot(...velocity).toFixed(1)} m/s` : "")]);
    if (attitude) lines.push([`nose ${degrees(noseUp(attitude))} up`]);
    if (thrust.length) lines.push([`thrust ${thrust.map((force) => force.toFixed(1)).join(" | ")} N`, INK.warning]);
    if (elevon.length) lines.push([`elevons ${elevon.map(degrees).join(" | ")}`]);
    if (wind && Math.hypot(...wind) >= LEAST_WIND) lines.push([`wind ${Math.hypot(wind[0], wind[1]).toFixed(1)} m/s`, INK.wind]);
    lines.push([`grid ${this.scene.cell} m`]);
    this.root.querySelector(".readings").replaceChildren(...lines.map(([words, ink]) => {
      const line = document.createElement("div");
      line.textContent = words;
      if (ink) line.style.color = ink;
      return line;
    }));
  }

  // Camera: "follow" the vehicle, "side" of its way, or "orbit" the whole path.
  look(mode) {
    this.mode = mode;
    this.root.querySelector("[data-do=camera]").value = mode;
    const { camera, controls } = this.scene;
    if (mode === "orbit") {
      const { low, high } = this.#seen();
      const wide = Math.max(high[0] - low[0], high[1] - low[1], high[2] - low[2], 3);
      controls.target.set((low[1] + high[1]) / 2, (low[0] + high[0]) / 2, -(low[2] + high[2]) / 2);
      camera.position.copy(controls.target).add(new THREE.Vector3(-0.8, -1.25, 0.8).multiplyScalar(wide));
    } else {
      controls.target.copy(this.scene.vehicle.getWorldPosition(new THREE.Vector3()));
      camera.position.copy(controls.target).add(new THREE.Vector3(-0.55, -0.85, 0.3).setLength(CLOSE));
    }
    controls.update();
    for (let k = 0; k < 60 && mode === "side"; k++) this.#standBeside();
    this.draw();
  }

  play(isPlaying) {
    if (isPlaying === this.isPlaying) return;
    this.isPlaying = isPlaying;
    this.root.querySelector("[data-do=play]").textContent = isPlaying ? "⏸" : "▶";
    if (isPlaying && this.time >= this.times.at(-1)) this.seek(this.times[0]);
    let last = null;
    const tick = (now) => {
      if (!this.isPlaying) return;
      if (last !== null) this.seek(this.time + Math.min((now - last) / 1000, 0.2) * this.speed);
      last = now;
      if (this.time >= this.times.at(-1)) this.#arrive();
      requestAnimationFrame(tick);
    };
    if (isPlaying) requestAnimationFrame(tick);
  }

  // At the end a recording stops, a live flight goes on.
  #arrive() {
    this.play(false);
    this.isLive = this.drawnUntil !== undefined;
  }

  toJump(direction) {
    const jumps = this.marks.filter(([, , , kind]) => kind !== "mode").map(([time]) => time);
    const next = direction > 0 ? jumps.find((time) => time > this.time + 0.01) : jumps.findLast((time) => time < this.time - 0.01);
    if (next !== undefined) this.seek(next);
  }

  #listen() {
    const actions = { play: () => this.play(!this.isPlaying), back: () => this.toJump(-1), next: () => this.toJump(1),
      pin: () => this.root.classList.toggle("pinned"), picture: () => this.#savePicture() };
    for (const [name, action] of Object.entries(actions))
      this.root.querySelector(`[data-do=${name}]`).addEventListener("click", action);
    const changed = (name, change) => {
      const input = this.root.querySelector(`[data-do=${name}]`);
      input.addEventListener("change", () => change(input));
    };
    changed("speed", (input) => { this.speed = Number(input.value); });
    changed("camera", (input) => this.look(input.value));
    changed("ghosts", (input) => { this.scene.ghosts.visible = input.checked; this.draw(); });
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    this.slider.addEventListener("change", () => { if (this.time >= this.times.at(-1) - 0.5) this.#arrive(); });
    this.scene.controls.addEventListener("change", () => this.draw());
    document.addEventListener("keydown", (event) => {
      if (event.target !== document.body || !this.times.length) return;
      const side = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (event.key === " ") this.play(!this.isPlaying);
      else if (side && event.shiftKey) this.toJump(side);
      else if (side) this.seek(this.time + side);
      else return;
      event.preventDefault();
    });
  }

  #savePicture() {
    const link = document.createElement("a");
    link.download = `${document.title} ${this.root.dataset.time} s.png`;
    link.href = this.scene.renderer.domElement.toDataURL();
    link.click();
  }

  #resize() {
    this.scene.resize(this.stage.clientWidth, this.stage.clientHeight);
    this.draw();
  }

  // At most once in what the screen shows at a time.
  draw() {
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => {
      this.isDue = false;
      this.scene.fitSize();
      this.scene.draw();
    });
  }
}

// Elevation of the nose [rad] of a quaternion FRD -> NED.
function noseUp([w, x, y, z]) {
  return Math.asin(Math.min(Math.max(2 * (w * y - x * z), -1), 1));
}

// The view in an element; words in its place where the browser has no WebGL.
function flightView(root) {
  try {
    return new FlightView(root);
  } catch (error) {
    root.textContent = `The flight is not drawn in 3-D: ${error.message}`;
    return null;
  }
}
