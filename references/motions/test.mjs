// Exact motions as a test of your engine: fill in `simulate`, then   node test.mjs   (CC0)
import { readdirSync, readFileSync } from "node:fs";
const ORDER = 2; // the order of your integrator: 1, 2 or 4
const ANGLE = 0.01; // |w| h, rad: 0.1, 0.03 or 0.01
const SINGLE = false; // single precision
const HAS = ["rotor", "torque", "damping", "fixed point", "orbit"]; // motions that need anything else are skipped

// YOUR ENGINE: set up the body of the motion `m`, and return [quaternion, rates] after each `steps` steps of h seconds:
// the quaternion has the scalar first and maps body to world, the rates are in body axes, rad/s.
function simulate(m, h, steps, samples) {
  const states = [];
  for (let i = 0; i < samples; i++) {
    for (let n = 0; n < steps; n++); // one step
    states.push([m.quaternion_wxyz0, m.w_WB_B0]);
  }
  return states;
}
// END

const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const apart = (a, b, sign = 1) => Math.hypot(...a.map((x, i) => x - sign * b[i]));
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
function rotate([s, ...u], v) {
  const uv = cross(u, v), uuv = cross(u, uv);
  return v.map((x, i) => x + 2 * (s * uv[i] + uuv[i]));
}

function errors(m, i, [q, w]) { // attitude, rad; rates, energy and momentum relative to the scales of the motion
  const L = m.inertia_B.map((row) => dot(row, w)), exact = m.quaternion_wxyz[i];
  const energy = dot(L, w) / 2 + (m.weight ?? 0) * rotate(q, m.com_B ?? [0, 0, 0])[2];
  const momentum = rotate(q, L.map((x, k) => x + (m.rotor_momentum_B ?? [0, 0, 0])[k]));
  return [4 * Math.asin(Math.min(1, apart(q, exact) / 2, apart(q, exact, -1) / 2)), apart(w, m.w_WB_B[i]) / m.scale.rates,
    Math.abs(energy - m.energy[i]) / m.scale.energy, apart(momentum, m.momentum_W[i]) / m.scale.momentum];
}

const names = ["attitude", "rates", "energy", "momentum"], folder = process.argv[2] ?? new URL(".", import.meta.url).pathname;
const NEAR = 0.8; // sum of the squares of four logarithms, of errors over those of a mistake that explains them
function worst(m, steps) { // the largest errors with so many steps before each sample
  const all = simulate(m, m.t[0] / steps, steps, m.t.length).map((state, i) => errors(m, i, state));
  return names.map((_, k) => Math.max(...all.map((e) => (Number.isNaN(e[k]) ? Infinity : e[k]))));
}

let failing = [], tested = 0; // of each motion that fails: its name, the mistakes that explain it, and the exponent of the step
for (const file of readdirSync(folder).filter((name) => name.endsWith(".json"))) {
  const m = JSON.parse(readFileSync(`${folder}/${file}`, "utf8")), part = m.features.find((each) => !HAS.includes(each));
  if (part) { console.log(`${m.name}: skipped, it has ${part}`); continue; }
  tested++;
  const allowed = m.tolerance.find((each) => each.order === ORDER && each.angle === ANGLE);
  const limit = names.map((name) => allowed[name] + (SINGLE ? m.single : 0)), found = worst(m, allowed.steps);
  const ratios = found.map((x, k) => x / limit[k]), ratio = Math.max(...ratios), most = ratios.indexOf(ratio);
  if (ratio <= 1) continue;
  const distance = (known) => names.reduce((sum, name, k) => sum + Math.log(Math.max(found[k], limit[k]) / Math.max(known[name], limit[k])) ** 2, 0);
  const near = m.catches.map((each) => [each.mistake, distance(each)]).filter(([, apart]) => apart < NEAR);
  const half = worst(m, 2 * allowed.steps)[most], falls = found[most] < Infinity && half > 0 ? Math.log2(found[most] / half) : 0;
  const text = `${m.name}: ${names[most]} error ${found[most].toExponential(1)}, tolerance ${limit[most].toExponential(1)}`;
  if (falls >= ORDER - 0.5 && (ratio <= 2 || !near.length)) {
    console.log(`${text}: ${(100 * (ratio - 1)).toFixed(0)} % above the tolerance, falls as h^${falls.toFixed(1)}: right`);
    continue;
  }
  console.log(text);
  failing.push({ name: m.name, near: new Map(near), falls });
}

console.log(`${failing.length} of ${tested} motions failed`);
let rest = failing;
for (let n = 0; n < 3; n++) { // the mistakes that explain most of the failing motions
  const votes = {};
  for (const { near } of rest) for (const [name, apart] of near) (votes[name] ??= []).push(apart);
  const order = (name) => [votes[name].length, -votes[name].reduce((a, b) => a + b)];
  const best = Object.keys(votes).sort((a, b) => order(b)[0] - order(a)[0] || order(b)[1] - order(a)[1])[0];
  if (!best || 10 * votes[best].length < failing.length) break;
  console.log(`"${best}" explains ${votes[best].length} of them`);
  rest = rest.filter((each) => !each.near.has(best));
}
const median = failing.map((each) => each.falls).sort((a, b) => a - b)[failing.length >> 1];
if (2 * rest.length > failing.length && median >= 0.5 && median < ORDER - 0.5)
  console.log(`this program has order ${median.toFixed(1)}, ${ORDER} was declared`);
if (rest.length)
  console.log(`${rest.length} not explained by a mistake of the list: ${rest.slice(0, 5).map((each) => each.name).join(", ")}`);
process.exitCode = Number(failing.length > 0);
