/* An engine in JavaScript, in the framing "lines" of PROTOCOL.md: Euler's equations of a free body by the method RK4. */
const derivative = ([a, b, c, d, x, v, z], [J1, J2, J3]) => [
  -(b * x + c * v + d * z) / 2, (a * x + c * z - d * v) / 2, (a * v + d * x - b * z) / 2, (a * z + b * v - c * x) / 2,
  ((J2 - J3) * v * z) / J1, ((J3 - J1) * z * x) / J2, ((J1 - J2) * x * v) / J3,
];
const add = (y, h, k) => y.map((value, i) => value + h * k[i]);
function step(y, h, J) {
  const k1 = derivative(y, J), k2 = derivative(add(y, h / 2, k1), J);
  const k3 = derivative(add(y, h / 2, k2), J), k4 = derivative(add(y, h, k3), J);
  return y.map((value, i) => value + (h / 6) * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i]));
}
function integrate({ q0, w0, n_steps, steps, dt, moments }) {
  const samples = [];
  for (let n = 0, y = [...q0, ...w0]; n <= n_steps; n++, y = step(y, dt, moments)) if (steps.includes(n)) samples.push(y);
  return { q: samples.map((y) => y.slice(0, 4)), w: samples.map((y) => y.slice(4)), evaluations: 4 * n_steps };
}
const runs = new Map();
const operations = {
  hello: () => ({ protocol: 1, program: 'javascript', version: process.version, framing: 'lines' }),
  check: () => ({}),
  prepare: (request) => {
    if (!request.free) return { error: 'unsupported', message: 'only free bodies' };
    runs.set(runs.size + 1, request);
    return { run: runs.size };
  },
  run: ({ run }) => integrate(runs.get(run)),
  time: ({ run, calls }) => {
    const seconds = (n) => { const start = performance.now(); for (let i = 0; i < n; i++) integrate(runs.get(run)); return (performance.now() - start) / 1000; };
    for (let spent = 0; spent < 0.02;) spent += seconds(1);
    return { seconds: seconds(calls) };
  },
};
require('readline').createInterface({ input: process.stdin }).on('line', (line) => {
  const request = JSON.parse(line);
  let answer;
  try { answer = operations[request.do](request); } catch (error) { answer = { error: error.name, message: error.message }; }
  console.log(JSON.stringify(answer));
});
