// Where everything is at a time: segments, landmarks, muscle lines.
// Segments by number: 0 thorax, 1 clavicle, 2 scapula, 3 humerus, 4 forearm; metres in thorax axes
// (x right, y up, z back).
const LENGTH_STEP = 1e-4;
const length = (steps) => steps * LENGTH_STEP;
const BAND_POINTS = 7, BAND_SWEEPS = 20;

const mix = (a, b, w) => a.map((value, i) => value + w * (b[i] - value));
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

function matrix(quaternion) {
  const norm = Math.hypot(...quaternion);
  const [a, b, c, d] = quaternion.map((value) => value / norm);
  return [[1 - 2 * (c * c + d * d), 2 * (b * c - a * d), 2 * (b * d + a * c)],
    [2 * (b * c + a * d), 1 - 2 * (b * b + d * d), 2 * (c * d - a * b)],
    [2 * (b * d - a * c), 2 * (c * d + a * b), 1 - 2 * (b * b + c * c)]];
}

/** Everything of a scene at a time [s], between frames by linear interpolation. */
function poseAt(scene, seconds) {
  const { time } = scene, after = time.findIndex((t) => t > seconds);
  const k = clamp(after < 0 ? time.length - 2 : after - 1, 0, Math.max(0, time.length - 2));
  const next = Math.min(k + 1, time.length - 1);
  const w = next > k ? clamp((seconds - time[k]) / (time[next] - time[k]), 0, 1) : 0;
  const row = (array) => {
    const width = array.length / time.length;
    return mix(Array.from(array.subarray(k * width, (k + 1) * width)),
      array.subarray(next * width, (next + 1) * width), w);
  };
  const origin = row(scene.origin), rotation = row(scene.rotation);
  const frames = [0, 1, 2, 3, 4].map((s) => (
    { origin: origin.slice(3 * s, 3 * s + 3), matrix: matrix(rotation.slice(4 * s, 4 * s + 4)) }));
  const place = ([s, ...p]) => toThorax(frames[s], p.map(length));
  const marks = Object.fromEntries(
    Object.entries(scene.landmarks).map(([name, point]) => [name, place(point)]));
  marks.elbow = mix(marks.EL, marks.EM, 0.5);
  const rim = scene.rim.map(place);
  marks.glenoid = rim.length ? mix(rim[0], rim[rim.length / 2], 0.5) : marks.GH;
  const measured = Object.fromEntries(
    Object.entries(scene.measured).map(([name, track]) => [name, row(track)]));
  const reaction = row(scene.reaction);
  return { frames, marks, measured, rim, activation: row(scene.activation), force: row(scene.force),
    newton: Math.hypot(...reaction), percent: row(scene.percent)[0],
    eccentricity: row(scene.eccentricity)[0],
    reaction: frames[2].matrix.map((axis) => dot(axis, reaction)),
    lines: scene.muscles.map((muscle) => muscleLine(muscle, frames, place)) };
}

const toThorax = ({ origin, matrix: m }, p) => origin.map((o, i) => o + dot(m[i], p));
const toSegment = ({ origin, matrix: m }, p) => {
  const d = p.map((value, i) => value - origin[i]);
  return [0, 1, 2].map((i) => m[0][i] * d[0] + m[1][i] * d[1] + m[2][i] * d[2]);
};

function muscleLine(muscle, frames, place) {
  const points = muscle.points.map(place);
  const line = [points[0]];
  for (let i = 1; i < points.length; i += 1) {
    line.push(...band(points[i - 1], points[i], muscle.surfaces, frames));
  }
  return line;
}

/** Taut band from a to b over ellipsoids, without its first point. */
function band(a, b, surfaces, frames) {
  const balls = surfaces.map(([s, ...size]) => {
    const centre = size.slice(0, 3).map(length), radii = size.slice(3).map(length);
    const inward = (p) => toSegment(frames[s], p).map((v, i) => (v - centre[i]) / radii[i]);
    const outward = (u) => toThorax(frames[s], u.map((v, i) => centre[i] + v * radii[i]));
    // An attachment inside the surface lies on a smaller one, so that the line never jumps.
    return { inward, outward, level: Math.min(1, ...[a, b].map((p) => Math.hypot(...inward(p)))) };
  });
  const pushed = (p) => balls.reduce((point, { inward, outward, level }) => {
    const u = inward(point), size = Math.hypot(...u);
    return size < level ? outward(u.map((v) => v * level / size)) : point;
  }, p);
  const count = BAND_POINTS + 1;
  const straight = Array.from({ length: count + 1 }, (_, i) => mix(a, b, i / count));
  const line = straight.map(pushed);
  if (line.every((p, i) => p === straight[i])) return [b];
  for (let sweep = 0; sweep < BAND_SWEEPS; sweep += 1) {
    for (let i = 1; i < count; i += 1) line[i] = pushed(mix(line[i - 1], line[i + 1], 0.5));
  }
  line[count] = b;
  return line.slice(1);
}
