const runs = []; // node my_engine.js
function integrate({ q0, w0, moments: J, dt: h, steps }) { // semi-implicit Euler
  let [a, b, c, d] = q0, [x, y, z] = w0;
  const q = [], w = [];
  for (let n = 0; q.length < steps.length; n++) {
    if (n === steps[q.length]) q.push([a, b, c, d]), w.push([x, y, z]);
    [x, y, z] = [x + h * (J[1] - J[2]) * y * z / J[0], y + h * (J[2] - J[0]) * z * x / J[1], z + h * (J[0] - J[1]) * x * y / J[2]];
    const e = a - h / 2 * (b * x + c * y + d * z), f = b + h / 2 * (a * x + c * z - d * y);
    const g = c + h / 2 * (a * y + d * x - b * z), i = d + h / 2 * (a * z + b * y - c * x), norm = Math.hypot(e, f, g, i);
    [a, b, c, d] = [e / norm, f / norm, g / norm, i / norm];
  }
  return { q, w };
}
const operations = {
  hello: () => ({ protocol: 1, program: 'JavaScript', version: '1', framing: 'lines' }),
  prepare: (given) => given.free ? { run: runs.push(given) - 1 } : { error: 'unsupported', message: 'only free bodies' },
  run: ({ run }) => integrate(runs[run]),
  time: ({ run, calls }) => {
    const measure = (n) => { const start = performance.now(); while (n-- > 0) integrate(runs[run]); return (performance.now() - start) / 1000; };
    for (runs[run].spent ??= 0; runs[run].spent < 0.02;) runs[run].spent += measure(1); // compilers optimise during these calls
    return { seconds: measure(calls) };
  },
};
require('readline').createInterface({ input: process.stdin }).on('line', (line) => {
  const request = JSON.parse(line);
  let answer;
  try { answer = operations[request.do](request); } catch (error) { answer = { error: error.name, message: error.message }; }
  console.log(JSON.stringify(answer));
});
