const METHOD = [];
const MISTAKE = process.env.MISTAKE ?? "";
const BOTH = "no gyroscopic term + damping 0.05";
const FLOAT = false;
const transpose = (A) => A[0].map((_, i) => A.map((row) => row[i]));
const apply = (A, v) => A.map((row) => dot(row, v));
const multiply = (A, B) => A.map((row) => transpose(B).map((column) => dot(row, column)));
const add = (a, b, scale = 1) => a.map((x, i) => x + scale * b[i]);
const sign = (zero, minus) => (MISTAKE === zero ? 0 : MISTAKE === minus ? -1 : 1);
const one = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
function inverse(A) {
  const c = [cross(A[1], A[2]), cross(A[2], A[0]), cross(A[0], A[1])], d = dot(A[0], c[0]);
  return transpose(c).map((row) => row.map((x) => x / d));
}
const matrix = (q) => transpose(one.map((e) => rotate(q.map((x) => x / Math.hypot(...q)), e)));
const turning = (q, w) => [-dot(q.slice(1), w), ...add(w.map((x) => q[0] * x), cross(q.slice(1), w))].map((x) => x / 2);
const wrongly = (q, w) => (MISTAKE === "wrong side" ? [-dot(q.slice(1), w), ...add(w.map((x) => q[0] * x), cross(w, q.slice(1)))].map((x) => x / 2) : turning(q, w));
function slope(body, t, y) {
  const q = y.slice(0, 4), w = y.slice(4), R = matrix(q), back = transpose(R), n = body.orbit;
  let J = body.J;
  if (MISTAKE === "R I for R I R'") J = multiply(J, R);
  if (MISTAKE === "inertia in world axes" || MISTAKE === "inertia of the start") {
    const start = MISTAKE === "inertia of the start" ? body.R0 : one;
    J = multiply(back, multiply(multiply(start, multiply(J, transpose(start))), R));
  }
  const K = J === body.J ? body.K : inverse(J);
  const G = J.map((row, i) => row.map((x, k) => (MISTAKE === "diagonal gyroscopic term" && i !== k ? 0 : x)));
  let T = cross(add(apply(G, w), body.rotor), w).map((x) => (MISTAKE === BOTH ? 0 : sign("no gyroscopic term", "sign of the gyroscopic term")) * x);
  T = add(add(add(T, body.torque_B), apply(back, body.torque_W)), apply(body.damping, w), -1);
  const field = sign("without the field", "sign of the field"), angle = MISTAKE === "turning of the field" ? 0 : n * t;
  const u = apply(back, [Math.cos(angle), Math.sin(angle), 0]);
  T = add(add(T, cross(R[2], body.arm), field), cross(u, apply(body.J, u)), field * 3 * n * n);
  return [...wrongly(q, w), ...apply(K, T)];
}
function step(body, t, h, y) {
  const s = METHOD[0], A = Array.from({ length: s }, (_, i) => METHOD.slice(1 + i * s, 1 + i * s + s)), b = METHOD.slice(1 + s * s);
  const k = A.map(() => Array(7).fill(0)), old = y, sweeps = A[0][0] === 0 && A[s - 1][s - 1] === 0 ? s : 30;
  for (let sweep = 0; sweep < sweeps; sweep++)
    for (let i = 0; i < s; i++)
      k[i] = slope(body, t + h * A[i].reduce((x, z) => x + z), A[i].reduce((Y, a, j) => add(Y, k[j], h * a), y));
  y = b.reduce((Y, weight, j) => add(Y, k[j], h * weight), y);
  const q = old.slice(0, 4), w = old.slice(4);
  if (MISTAKE === "attitude by normalisation") y = [...add(q, turning(q, y.slice(4)), h), ...y.slice(4)];
  if (MISTAKE === "stale rates") {
    const half = (h * Math.hypot(...w)) / 2, turn = turning(q, w);
    y = [...q.map((x, i) => Math.cos(half) * x + ((Math.sin(half) * h) / half) * turn[i]), ...y.slice(4)];
  }
  const size = Math.hypot(...y.slice(0, 4)), speed = Math.hypot(...y.slice(4));
  let scale = Math.exp(-h * Number(MISTAKE.match(/damping (0.*)/)?.[1] ?? 0));
  if (MISTAKE === "rate limit 100" && speed > 100) scale = 100 / speed;
  if (MISTAKE === "sleep" && speed < 0.5) scale = 0;
  y = y.map((x, i) => (i < 4 ? x / size : x * scale));
  return FLOAT ? y.map(Math.fround) : y;
}
function simulate(m, h, steps, samples) {
  const zero = [0, 0, 0], scaled = (v, by) => (v ?? zero).map((x) => by * x);
  const products = sign("no products of inertia", "sign of the products of inertia");
  let J = m.inertia_B.map((row, i) => row.map((x, k) => (i === k ? x : products * x)));
  if (MISTAKE === "smallest moments" && J[0][0] < 1e-6) J = one.map((row) => scaled(row, 1e-6));
  const torque = sign("without the torque", "sign of the torque"), other = MISTAKE === "axes of the torque";
  const body = {
    J, K: inverse(J), R0: matrix(m.quaternion_wxyz0), orbit: m.orbit ?? 0, arm: scaled(m.com_B, m.weight ?? 0),
    rotor: scaled(m.rotor_momentum_B, sign("without the rotor", "sign of the rotor")),
    damping: (MISTAKE === "without the damping" ? null : m.damping) ?? [zero, zero, zero],
    torque_B: scaled(other ? m.torque_W : m.torque_B, torque), torque_W: scaled(other ? m.torque_B : m.torque_W, torque),
  };
  const states = [];
  for (let i = 0, t = 0, y = [...m.quaternion_wxyz0, ...m.w_WB_B0]; i < samples; i++) {
    for (let n = 0; n < steps; n++) {
      const size = MISTAKE === "half a step late" && i + n === 0 ? h / 2 : h;
      y = step(body, t, size, y);
      t += size;
    }
    let q = y.slice(0, 4), w = y.slice(4);
    if (MISTAKE === "world rates") w = apply(matrix(q), w);
    if (MISTAKE === "reversed rates") w = scaled(w, -1);
    if (MISTAKE === "transposed") q = [q[0], -q[1], -q[2], -q[3]];
    if (MISTAKE.includes("order xyzw")) q = [...q.slice(1), q[0]];
    states.push([q, w]);
  }
  return states;
}
