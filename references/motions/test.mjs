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
const files = readdirSync(folder).filter((name) => name.endsWith(".json"));
let failed = 0;
for (const file of files) {
  const m = JSON.parse(readFileSync(`${folder}/${file}`, "utf8")), part = m.needs.find((each) => !HAS.includes(each));
  if (part) { console.log(`${m.name}: skipped, it needs ${part}`); continue; }
  const allowed = m.tolerance.find((each) => each.order === ORDER && each.angle === ANGLE);
  const limit = names.map((name) => allowed[name] + (SINGLE ? m.single : 0));
  const all = simulate(m, m.t[0] / allowed.steps, allowed.steps, m.t.length).map((state, i) => errors(m, i, state));
  const worst = names.map((_, k) => Math.max(...all.map((e) => (Number.isNaN(e[k]) ? Infinity : e[k]))));
  const ratios = worst.map((x, k) => x / limit[k]), most = ratios.indexOf(Math.max(...ratios));
  if (ratios[most] <= 1) continue;
  const distance = (known) => names.reduce((sum, name, k) => sum + Math.log(Math.max(worst[k], limit[k]) / Math.max(known[name], limit[k])) ** 2, 0);
  const near = m.catches.reduce((best, each) => (distance(each) < best[0] ? [distance(each), each] : best), [0.5, null])[1];
  const advice = near ? `this is what a program does with: ${near.mistake}` : "no mistake of the list does this";
  console.log(`${m.name}: ${names[most]} error ${worst[most].toExponential(1)}, tolerance ${limit[most].toExponential(1)}; ${advice}`);
  failed++;
}
console.log(`${failed} of ${files.length} motions failed`);
process.exitCode = Number(failed > 0);
