/* Functions that adapters in JavaScript share. Quaternions have the scalar first. */

const product = ([a, b, c, d], [s, x, y, z]) => [
  a * s - b * x - c * y - d * z, a * x + b * s + c * z - d * y, a * y - b * z + c * s + d * x, a * z + b * y - c * x + d * s,
];
const conjugate = ([s, x, y, z]) => [s, -x, -y, -z];
const rotate = (q, v) => product(product(q, [0, ...v]), conjugate(q)).slice(1);

/** Return the start of a body whose axes C are principal and at the centre of mass: attitude, position and velocity in the world.
 * `point` is the fixed point in C. */
export function central({ q0, w0_W: [x, y, z], com, q_com }) {
  const [a, b, c] = rotate(q0, com), velocity = [y * c - z * b, z * a - x * c, x * b - y * a];
  return { q: product(q0, q_com), position: [a, b, c], velocity, point: rotate(conjugate(q_com), com.map((value) => -value)) };
}

/** Return a run of the world that `build(own)` makes anew for each call, which is not measured. `destroy` is called for all objects
 * given to `own`, in reverse order. The world has functions `step()` and `read()`, which returns the attitude of axes that are
 * turned by `axes` relative to F, and the rates in world axes. */
export function runOf({ q0, w0_W, steps }, build, destroy = () => {}, axes = [1, 0, 0, 0]) {
  const n = steps.length, owned = [], own = (object) => (owned.push(object), object);
  let world = null;
  function run() {
    if (!world) run.renew();
    const { step, read } = world, q = new Float64Array(4 * n), w_W = new Float64Array(3 * n);
    for (let i = 0, done = 0; i < n; i++) {
      for (; done < steps[i]; done++) step();
      const [turn, rates] = read();
      q.set(product(turn, conjugate(axes)), 4 * i);
      w_W.set(rates, 3 * i);
    }
    q.set(q0); // in double precision
    w_W.set(w0_W);
    world = null;
    return { q: Object.assign(q, { shape: [n, 4] }), w_W: Object.assign(w_W, { shape: [n, 3] }) };
  }
  run.dispose = () => {
    while (owned.length) destroy(owned.pop());
  };
  run.renew = () => {
    run.dispose();
    world = build(own);
  };
  return run;
}
