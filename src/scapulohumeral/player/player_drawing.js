// The picture: projection, painter, bones, muscles, joint force and legend.
const BONE = [239, 230, 207], BONE_EDGE = [120, 103, 72], THORAX = [150, 163, 172];
const GHOST = [0, 114, 178], FORCE = [0, 114, 178], MEASURED = [230, 120, 0];
// Light to dark, so that the order survives grey print and colour blindness (after ColorBrewer).
const SCALE = [[178, 186, 194], [242, 178, 60], [238, 120, 34], [205, 32, 32], [96, 0, 38]];
// Bones between landmarks, with radii in mm; the first two belong to the thorax.
const TUBES = [["IJ", "PX", 6], ["C7", "T8", 9], ["SC", "AC", 6], ["TS", "AA", 4], ["AA", "AC", 5],
  ["GH", "elbow", 11], ["EM", "EL", 9], ["EM", "US", 6], ["Capitulum", "RS", 6],
  ["Wrist", "knuckle", 14]];
const PLATES = [["TS", "AI", "glenoid"], ["TS", "glenoid", "AA"]];
const LABELLED = [
  "IJ", "PX", "C7", "T8", "SC", "AC", "AA", "TS", "AI", "GH", "EL", "EM", "US", "RS",
];
const JOINTS = ["SC", "AC", "GH", "elbow", "Wrist"];
const METRES_PER_NEWTON = 1 / 5000;

const css = (rgb, alpha = 1) => `rgba(${rgb.map(Math.round).join()},${alpha})`;

function camera(state, width, height, pixels) {
  const yaw = state.yaw * Math.PI / 180, pitch = state.pitch * Math.PI / 180;
  const [sy, cy, sp, cp] = [Math.sin(yaw), Math.cos(yaw), Math.sin(pitch), Math.cos(pitch)];
  const right = [-cy, 0, -sy], forward = [-sy * cp, -sp, cy * cp], up = [-sy * sp, cp, cy * sp];
  return (p) => {
    const d = p.map((value, i) => value - state.centre[i]);
    return [width / 2 + pixels * dot(right, d), height / 2 - pixels * dot(up, d), dot(forward, d)];
  };
}

/** Colour of an activation [0, 1 = top of the scale]. */
function colour(share) {
  const place = clamp(share, 0, 1) * (SCALE.length - 1);
  const k = Math.min(SCALE.length - 2, Math.floor(place));
  return mix(SCALE[k], SCALE[k + 1], place - k);
}
const muscleWidth = (newton) => Math.min(8, 0.9 + 0.36 * Math.sqrt(Math.max(0, newton)));
// What is further away is paler.
const faded = (rgb, depth) => mix(rgb, [255, 255, 255], clamp((depth + 0.1) / 0.6, 0, 0.5));

function stroke(context, points, style, width, close = false) {
  context.lineCap = "round";
  context.lineJoin = "round";
  context.beginPath();
  points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
  if (close) context.closePath();
  context.strokeStyle = style;
  context.lineWidth = width;
  context.stroke();
}

function fill(context, points, style) {
  context.beginPath();
  points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
  context.closePath();
  context.fillStyle = style;
  context.fill();
}

function disc(context, [x, y], radius, style, edge) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fillStyle = style;
  context.fill();
  context.strokeStyle = edge;
  context.lineWidth = 1;
  context.stroke();
}

/** Things to draw, each with its depth; the painter starts with the furthest. */
class Painter {
  constructor(context, project, pixels) {
    Object.assign(this, { context, project, pixels, items: [] });
  }

  add(depth, draw) { this.items.push([depth, draw]); }

  paint() { this.items.sort((a, b) => b[0] - a[0]).forEach(([, draw]) => draw()); }

  /** Line, drawn as if it were nearer by some metres. */
  wire(points, rgb, width, nearer = 0) {
    const seen = points.map(this.project);
    for (let i = 1; i < seen.length; i += 1) {
      const depth = (seen[i - 1][2] + seen[i][2]) / 2;
      this.add(depth - nearer, () => (
        stroke(this.context, [seen[i - 1], seen[i]], css(faded(rgb, depth)), width)));
    }
  }

  tube(a, b, millimetres) {
    const width = 2 * millimetres * this.pixels / 1000, pieces = 8;
    for (let i = 0; i < pieces; i += 1) {
      const ends = [mix(a, b, i / pieces), mix(a, b, (i + 1) / pieces)].map(this.project);
      const depth = (ends[0][2] + ends[1][2]) / 2;
      // The outline goes behind the neighbouring pieces too, so that no joint shows.
      const behind = depth + Math.abs(ends[1][2] - ends[0][2]) + 1e-3;
      this.add(behind, () => stroke(this.context, ends, css(faded(BONE_EDGE, depth)), width + 2));
      this.add(depth, () => stroke(this.context, ends, css(faded(BONE, depth)), width));
    }
  }

  plate(corners) {
    const seen = corners.map(this.project), pieces = 5;
    const at = (i, j) => {
      const [u, v] = [i / pieces, j / pieces];
      return [0, 1, 2].map((k) => seen[0][k] * (1 - u - v) + seen[1][k] * u + seen[2][k] * v);
    };
    const piece = (triangle) => {
      const depth = (triangle[0][2] + triangle[1][2] + triangle[2][2]) / 3;
      const style = css(faded(BONE, depth));
      this.add(depth, () => {
        fill(this.context, triangle, style);
        stroke(this.context, triangle, style, 1, true);
      });
    };
    for (let i = 0; i < pieces; i += 1) {
      for (let j = 0; i + j < pieces; j += 1) {
        piece([at(i, j), at(i + 1, j), at(i, j + 1)]);
        if (i + j + 1 < pieces) piece([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
      }
    }
    corners.forEach((corner, i) => {
      const edge = [0, 0.25, 0.5, 0.75, 1].map((w) => mix(corner, corners[(i + 1) % 3], w));
      this.wire(edge, BONE_EDGE, 1.3, 0.002);
    });
  }

  ball(centre, metres, rgb, edge) {
    const seen = this.project(centre);
    const [inner, outer] = [rgb, edge].map((style) => css(faded(style, seen[2])));
    this.add(seen[2] - metres, () => (
      disc(this.context, seen, metres * this.pixels, inner, outer)));
  }
}

function addThorax(painter, [, ...size]) {
  const centre = size.slice(0, 3).map(length), radii = size.slice(3).map(length);
  const at = (u, v) => [Math.cos(u) * Math.cos(v), Math.sin(v), Math.sin(u) * Math.cos(v)]
    .map((value, i) => centre[i] + value * radii[i]);
  const turn = Array.from({ length: 49 }, (_, i) => i * Math.PI / 24);
  for (let v = -75; v <= 75; v += 15) {
    painter.wire(turn.map((u) => at(u, v * Math.PI / 180)), THORAX, 1);
  }
  for (let u = 0; u < 180; u += 30) {
    const half = turn.map((v) => v - Math.PI / 2);
    painter.wire(half.map((v) => at(u * Math.PI / 180, v)), THORAX, 0.6);
  }
}

const known = (marks, names) => names.every((name) => marks[name]);

function addBones(painter, scene, { marks, measured }) {
  if (scene.thorax) addThorax(painter, scene.thorax);
  TUBES.filter(([a, b]) => known(marks, [a, b]))
    .forEach(([a, b, millimetres]) => painter.tube(marks[a], marks[b], millimetres));
  PLATES.filter((corners) => known(marks, corners))
    .forEach((corners) => painter.plate(corners.map((name) => marks[name])));
  painter.ball(marks.GH, length(scene.head), BONE, BONE_EDGE);
  JOINTS.filter((name) => marks[name])
    .forEach((name) => painter.ball(marks[name], 0.004, [60, 60, 60], [60, 60, 60]));
  Object.values(measured).forEach((place) => painter.ball(place, 0.006, MEASURED, [90, 45, 0]));
}

function addMuscles(painter, scene, pose, state) {
  const drawn = [];
  pose.lines.forEach((line, m) => {
    if (state.group && scene.muscles[m].group !== state.group) return;
    const seen = line.map(painter.project), width = muscleWidth(pose.force[m]);
    const rgb = colour(pose.activation[m] / state.top);
    drawn.push({ muscle: m, seen });
    for (let i = 1; i < seen.length; i += 1) {
      const ends = [seen[i - 1], seen[i]], depth = (ends[0][2] + ends[1][2]) / 2;
      // The halo goes behind the neighbouring pieces too, or the line would look dashed.
      painter.add(depth + Math.abs(ends[1][2] - ends[0][2]) + 1e-3, () => (
        stroke(painter.context, ends, "rgba(255,255,255,.7)", width + 2)));
      const style = css(m === state.picked ? [0, 0, 0] : faded(rgb, depth));
      painter.add(depth, () => stroke(painter.context, ends, style, width));
    }
  });
  return drawn;
}

function drawGhost(context, project, { marks }) {
  const style = css(GHOST, 0.75);
  context.setLineDash([6, 4]);
  const lines = [...TUBES.slice(2).map(([a, b]) => [a, b]), ...PLATES];
  lines.filter((names) => known(marks, names)).forEach((names) => (
    stroke(context, names.map((name) => project(marks[name])), style, 2, names.length > 2)));
  context.setLineDash([]);
  disc(context, project(marks.GH), 4, "#fff", style);
}

function arrow(context, tail, tip) {
  const angle = Math.atan2(tip[1] - tail[1], tip[0] - tail[0]);
  const wing = (turn) => (
    [tip[0] - 13 * Math.cos(angle + turn), tip[1] - 13 * Math.sin(angle + turn)]);
  stroke(context, [tail, tip], "#fff", 7);
  stroke(context, [tail, tip], css(FORCE), 3.5);
  fill(context, [tip, wing(0.42), wing(-0.42)], css(FORCE));
}

function drawForce(context, project, pose) {
  if (!pose.rim.length) return;
  stroke(context, pose.rim.map(project), "#fff", 4, true);
  stroke(context, pose.rim.map(project), "#000", 1.8, true);
  if (pose.newton < 1) return;
  const tail = pose.marks.GH.map((value, i) => value - pose.reaction[i] * METRES_PER_NEWTON);
  const axis = pose.marks.GH.map((value, i) => value - pose.marks.glenoid[i]);
  const along = dot(axis, axis) / dot(axis, pose.reaction);
  arrow(context, project(tail), project(pose.marks.GH));
  if (along <= 0) return;
  const pierced = pose.marks.GH.map((value, i) => value - along * pose.reaction[i]);
  disc(context, project(pierced), 4.5, pose.eccentricity <= 1 ? "#000" : "#fff", "#000");
}

function drawTitle(context, state, scene, ghost) {
  const named = ({ label, converged }) => (
    converged ? label : `${label}: NOT CONVERGED, no result`);
  context.font = "13px system-ui, sans-serif";
  context.fillStyle = scene.converged ? "#222" : "#b00020";
  context.fillText(named(scene), 12, 20);
  context.fillStyle = "#222";
  context.fillText(`t = ${state.time.toFixed(2)} s`, 12, 38);
  if (!ghost) return;
  context.fillStyle = css(GHOST);
  context.fillText(`dashed: ${named(ghost)}`, 12, 56);
}

/** What colour, width and arrow mean, along the lower edge. */
function drawLegend(context, height, state, pixels) {
  const [title, sample, numbers] = [height - 40, height - 29, height - 12];
  for (let i = 0; i < 100; i += 1) {
    context.fillStyle = css(colour(i / 99));
    context.fillRect(12 + i, sample - 5, 1.5, 10);
  }
  [10, 50, 200].forEach((newton, i) => {
    const x = 145 + 46 * i;
    stroke(context, [[x, sample], [x + 28, sample]], "#666", muscleWidth(newton));
  });
  arrow(context, [295, sample], [295 + 500 * METRES_PER_NEWTON * pixels, sample]);
  context.font = "12px system-ui, sans-serif";
  context.fillStyle = "#222";
  [["activation", 12, title], ["0", 12, numbers], [`≥ ${state.top.toFixed(1)}`, 94, numbers],
    ["muscle force", 145, title], ["10 N", 145, numbers], ["50 N", 191, numbers],
    ["200 N", 237, numbers], ["joint force", 295, title], ["500 N", 295, numbers],
  ].forEach(([text, x, y]) => context.fillText(text, x, y));
}

/** Directions of the thorax axes, in the lower right corner. */
function drawAxes(context, width, height, state) {
  const middle = { ...state, centre: [0, 0, 0] };
  const project = camera(middle, 2 * (width - 60), 2 * (height - 60), 30);
  const [x0, y0] = project([0, 0, 0]);
  context.font = "12px system-ui, sans-serif";
  context.fillStyle = "#222";
  context.textAlign = "center";
  [["right", [1, 0, 0]], ["up", [0, 1, 0]], ["back", [0, 0, 1]]].forEach(([name, axis]) => {
    const [x, y] = project(axis);
    if (Math.hypot(x - x0, y - y0) < 8) return;
    stroke(context, [[x0, y0], [x, y]], "#888", 1.5);
    context.fillText(name, x0 + 1.45 * (x - x0), y0 + 1.45 * (y - y0) + 4);
  });
  context.textAlign = "left";
}

function drawNames(context, project, marks) {
  context.font = "12px system-ui, sans-serif";
  LABELLED.filter((name) => marks[name]).forEach((name) => {
    const [x, y] = project(marks[name]);
    context.lineWidth = 3;
    context.strokeStyle = "#fff";
    context.strokeText(name, x + 6, y - 5);
    context.fillStyle = "#222";
    context.fillText(name, x + 6, y - 5);
  });
}
