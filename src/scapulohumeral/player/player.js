// The page element: its data, its state, its controls.
const VIEWS = { front: [0, 0], side: [90, 0], back: [180, 0], oblique: [40, 12] };
// Height of the picture at zoom 1.
const METRES_SHOWN = 0.8;
const NUMBERS = [
  "origin", "rotation", "activation", "force", "reaction", "percent", "eccentricity",
];

function unpack({ step, data }) {
  const bytes = Uint8Array.from(atob(data), (character) => character.charCodeAt(0));
  return Float64Array.from(new Int16Array(bytes.buffer), (whole) => whole * step);
}

function readScenes(root) {
  const scenes = JSON.parse(root.querySelector("script[type='application/json']").textContent);
  scenes.forEach((scene) => {
    NUMBERS.forEach((name) => { scene[name] = unpack(scene[name]); });
    Object.entries(scene.measured).forEach(([name, track]) => {
      scene.measured[name] = unpack(track);
    });
  });
  return scenes;
}

/** Top of the colour scale: the peak that one element in a hundred exceeds, in tenths. */
function topOfScale(scenes) {
  const peaks = scenes.flatMap(({ muscles, activation }) => muscles.map((_, m) => {
    let peak = 0;
    for (let i = m; i < activation.length; i += muscles.length) {
      peak = Math.max(peak, activation[i]);
    }
    return peak;
  })).sort((a, b) => a - b);
  return peaks.length ? Math.ceil(10 * peaks[Math.floor(0.99 * (peaks.length - 1))]) / 10 || 1 : 1;
}

/** Number of the muscle within a few pixels of a place on the screen, or null. */
function nearest(drawn, x, y) {
  let [best, found] = [7, null];
  drawn.forEach(({ muscle, seen }) => {
    for (let i = 1; i < seen.length; i += 1) {
      const [a, b] = [seen[i - 1], seen[i]], d = [b[0] - a[0], b[1] - a[1]];
      const w = clamp(((x - a[0]) * d[0] + (y - a[1]) * d[1]) / (d[0] ** 2 + d[1] ** 2 || 1), 0, 1);
      const away = Math.hypot(x - a[0] - w * d[0], y - a[1] - w * d[1]);
      if (away < best) [best, found] = [away, muscle];
    }
  });
  return found;
}

const degrees = (radians) => (radians * 180 / Math.PI).toFixed(0);

/** What the line below the picture says. */
function reading(scene, pose, picked) {
  const [humerus, scapula] = [pose.frames[3].matrix, pose.frames[2].matrix];
  const parts = [
    `arm elevation ${degrees(Math.acos(clamp(humerus[1][1], -1, 1)))}°`,
    `scapular upward rotation ${degrees(Math.asin(clamp(scapula[1][0], -1, 1)))}°`,
  ];
  if (pose.newton >= 1) {
    const side = pose.eccentricity <= 1 ? "inside" : "outside";
    parts.push(`glenohumeral force ${pose.newton.toFixed(0)} N `
      + `(${pose.percent.toFixed(0)} % of body weight), ${side} the rim `
      + `(eccentricity ${pose.eccentricity.toFixed(2)})`);
  }
  if (picked !== null && picked < scene.muscles.length) {
    const { name, group } = scene.muscles[picked];
    parts.push(`${name} (${group}): activation ${pose.activation[picked].toFixed(2)}, `
      + `${pose.force[picked].toFixed(0)} N`);
  }
  return parts.join(" · ");
}

class Player {
  constructor(root) {
    this.canvas = root.querySelector("canvas");
    this.context = this.canvas.getContext("2d");
    this.scenes = readScenes(root);
    this.control = {};
    root.querySelectorAll("[data-control]").forEach((e) => {
      this.control[e.dataset.control] = e;
    });
    const { GH, IJ } = poseAt(this.scenes[0], 0).marks;
    this.state = {
      scene: 0, ghost: null, group: "", names: false, picked: null,
      time: 0, speed: 1, playing: false,
      yaw: VIEWS.oblique[0], pitch: VIEWS.oblique[1], zoom: 1, centre: mix(GH, IJ, 0.35),
      top: topOfScale(this.scenes),
    };
    this.listenToControls();
    this.listenToButtons(root);
    this.listenToPointer();
    this.listenToKeys();
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    this.change({ time: this.end / 2 });
  }

  get scene() { return this.scenes[this.state.scene]; }

  get end() { return this.scene.time.at(-1); }

  pose(time) { return poseAt(this.scene, time); }

  /** Set some of the state and show it. */
  change(values) {
    const state = Object.assign(this.state, values);
    state.time = clamp(state.time, 0, this.end);
    state.pitch = clamp(state.pitch, -90, 90);
    state.zoom = clamp(state.zoom, 0.3, 6);
    this.draw();
  }

  draw() {
    const { canvas, context, scene, state } = this;
    const { clientWidth: width, clientHeight: height } = canvas;
    const sharp = window.devicePixelRatio || 1;
    canvas.width = width * sharp;
    canvas.height = height * sharp;
    context.setTransform(sharp, 0, 0, sharp, 0, 0);
    context.fillStyle = "#fff";
    context.fillRect(0, 0, width, height);
    const pixels = state.zoom * Math.min(width, height) / METRES_SHOWN;
    const project = camera(state, width, height, pixels);
    const painter = new Painter(context, project, pixels);
    const pose = this.pose(state.time);
    addBones(painter, scene, pose);
    this.drawn = addMuscles(painter, scene, pose, state);
    painter.paint();
    drawForce(context, project, pose);
    const ghost = state.ghost === null ? null : this.scenes[state.ghost];
    if (ghost) drawGhost(context, project, poseAt(ghost, state.time));
    if (state.names) drawNames(context, project, pose.marks);
    drawTitle(context, state, scene, ghost);
    if (scene.muscles.length) drawLegend(context, height, state, pixels);
    drawAxes(context, width, height, state);
    this.describe(reading(scene, pose, state.picked));
  }

  describe(text) {
    const { canvas, control, scene, state } = this;
    control.time.max = this.end;
    control.time.value = state.time;
    control.readout.textContent = text;
    const moment = `${scene.label}, at ${state.time.toFixed(1)} s`;
    canvas.setAttribute("aria-label", `3-D view of the shoulder, ${moment}: ${text}`);
  }

  play(playing) {
    this.state.playing = playing;
    this.control.play.textContent = playing ? "Pause" : "Play";
    this.before = performance.now();
    if (playing) requestAnimationFrame((now) => this.tick(now));
  }

  tick(now) {
    const { state } = this;
    if (!state.playing) return;
    const time = state.time + state.speed * Math.max(0, now - this.before) / 1000;
    this.before = now;
    this.change({ time: time > this.end ? 0 : time });
    requestAnimationFrame((next) => this.tick(next));
  }

  listenToControls() {
    const { play, time, speed, scene, ghost, group, names } = this.control;
    const on = (element, event, values) => (
      element.addEventListener(event, () => this.change(values(element))));
    play.addEventListener("click", () => this.play(!this.state.playing));
    on(time, "input", ({ value }) => ({ time: Number(value) }));
    on(speed, "change", ({ value }) => ({ speed: Number(value) }));
    on(scene, "change", ({ value }) => ({ scene: Number(value), picked: null }));
    on(ghost, "change", ({ value }) => ({ ghost: value === "" ? null : Number(value) }));
    on(group, "change", ({ value }) => ({ group: value }));
    on(names, "change", ({ checked }) => ({ names: checked }));
  }

  listenToButtons(root) {
    root.querySelectorAll("[data-view]").forEach((button) => {
      const [yaw, pitch] = VIEWS[button.dataset.view];
      button.addEventListener("click", () => this.change({ yaw, pitch }));
    });
    root.querySelectorAll("[data-zoom]").forEach((button) => {
      const factor = Number(button.dataset.zoom);
      button.addEventListener("click", () => this.change({ zoom: this.state.zoom * factor }));
    });
  }

  listenToPointer() {
    const { canvas, state } = this;
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons) {
        const [yaw, pitch] = [state.yaw + event.movementX / 2, state.pitch + event.movementY / 2];
        this.change({ yaw, pitch });
        return;
      }
      const picked = nearest(this.drawn, event.offsetX, event.offsetY);
      if (picked !== state.picked) this.change({ picked });
    });
    canvas.addEventListener("wheel", (event) => {
      // Without focus the wheel scrolls the page.
      if (document.activeElement !== canvas) return;
      event.preventDefault();
      this.change({ zoom: state.zoom * Math.exp(-0.0015 * event.deltaY) });
    }, { passive: false });
  }

  listenToKeys() {
    const { state } = this;
    const keys = {
      ArrowLeft: () => this.change({ yaw: state.yaw - 5 }),
      ArrowRight: () => this.change({ yaw: state.yaw + 5 }),
      ArrowUp: () => this.change({ pitch: state.pitch + 5 }),
      ArrowDown: () => this.change({ pitch: state.pitch - 5 }),
      "+": () => this.change({ zoom: 1.25 * state.zoom }),
      "-": () => this.change({ zoom: 0.8 * state.zoom }),
      ",": () => this.change({ time: state.time - 0.05 }),
      ".": () => this.change({ time: state.time + 0.05 }),
      " ": () => this.play(!state.playing),
    };
    this.canvas.addEventListener("keydown", (event) => {
      if (!keys[event.key]) return;
      event.preventDefault();
      keys[event.key]();
    });
  }
}

document.querySelectorAll(".shoulder-player:not([data-started])").forEach((root) => {
  root.dataset.started = "";
  // Within reach of pages that want a certain moment, and of tests.
  root.player = new Player(root);
});
