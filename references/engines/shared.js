/* Functions that several adapters in JavaScript share. Quaternions have the scalar first. */
'use strict';

/** Return the product of two quaternions. */
function product([a, b, c, d], [s, x, y, z]) {
  return [a * s - b * x - c * y - d * z, a * x + b * s + c * z - d * y, a * y - b * z + c * s + d * x, a * z + b * y - c * x + d * s];
}

const conjugate = ([s, x, y, z]) => [s, -x, -y, -z];
const rotate = (q, v) => product(product(q, [0, ...v]), conjugate(q)).slice(1);

/** Return attitude, centre and velocity at the start of axes C, principal at the centre of mass, and the fixed point in C. */
exports.start = ({ q0, w0_W: [x, y, z], com, q_com }) => {
  const centre = rotate(q0, com), [a, b, c] = centre, point = rotate(conjugate(q_com), com).map((value) => -value);
  return { attitude: product(q0, q_com), centre, velocity: [y * c - z * b, z * a - x * c, x * b - y * a], point };
};

/** Return functions `own(object)`, which returns it, and `free()`, which destroys all objects, the last one first. */
exports.owner = (destroy) => {
  const owned = [];
  return { own: (object) => { owned.push(object); return object; }, free: () => { while (owned.length) destroy(owned.pop()); } };
};

/** Return a run of a world that `build` makes anew for each call, which is not measured.
 *
 * A world has functions: `step()`, `read()`, which returns attitude and rates in world axes, and `free()`, if needed. `q_com`:
 * the attitude is that of the axes C.
 */
exports.runOf = ({ q0, w0_W, steps }, build, q_com = [1, 0, 0, 0]) => {
  const n = steps.length, back = conjugate(q_com);
  let world = null, used = true;
  const run = () => {
    if (used) run.renew();
    used = true;
    const q = Object.assign(new Float64Array(4 * n), { shape: [n, 4] }), w_W = Object.assign(new Float64Array(3 * n), { shape: [n, 3] });
    for (let i = 0, done = 0; i < n; i++) {
      for (; done < steps[i]; done++) world.step();
      const [turn, rates] = world.read();
      q.set(product(turn, back), 4 * i);
      w_W.set(rates, 3 * i);
    }
    q.set(q0);  // in double precision
    w_W.set(w0_W);
    return { q, w_W };
  };
  run.renew = () => {
    run.dispose();
    [world, used] = [build(), false];
  };
  run.dispose = () => {
    world?.free?.();
    world = null;
  };
  return run;
};
