"use strict";
// The physics of the page "Why does it flip?": a free body, exactly and with an integrator that loses energy, for the player of
// reports/animation. The player draws `content` and draws it again after each event of that name. Vectors are in principal axes; the
// body spins about the third one. A test compares the motions with the exact solution of the package and with its own integrator.
for (const page of document.querySelectorAll(".flip")) {
  const motion = page.querySelector(".motion"), said = page.querySelector(".said");
  const duration = Number(motion.querySelector(".time").max), h = 1 / 60, frames = Math.round(duration / h) + 1;
  const { colours } = JSON.parse(motion.querySelector(".data").textContent);
  const sliders = [...page.querySelectorAll(".settings input")], FINE = 48; // steps of RK4 in a frame
  const { hypot, sqrt, abs, sin, cos } = Math;

  const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const times = ([a, b, c, d], [x, y, z, s]) => [ // quaternions, the real part last
    d * x + a * s + b * z - c * y, d * y - a * z + b * s + c * x, d * z + a * y - b * x + c * s, d * s - a * x - b * y - c * z,
  ];
  const unit = (q) => q.map((x) => x / hypot(...q));
  const turn = ([x, y, z, s], v) => { // of body components into world components
    const t = cross([x, y, z], v).map((c) => 2 * c), u = cross([x, y, z], t);
    return v.map((c, i) => c + s * t[i] + u[i]);
  };

  // Euler's equations J w' = J w x w and q' = q w / 2, by Runge and Kutta's method in steps so short that its error cannot be seen.
  function exact(J, state) {
    const slope = ([q0, q1, q2, q3, a, b, c]) => [
      (q3 * a + q1 * c - q2 * b) / 2, (q3 * b - q0 * c + q2 * a) / 2, (q3 * c + q0 * b - q1 * a) / 2, -(q0 * a + q1 * b + q2 * c) / 2,
      ((J[1] - J[2]) * b * c) / J[0], ((J[2] - J[0]) * c * a) / J[1], ((J[0] - J[1]) * a * b) / J[2],
    ];
    const along = (y, k, s) => y.map((each, i) => each + s * k[i]), s = h / FINE;
    for (let n = 0; n < FINE; n++) {
      const a = slope(state), b = slope(along(state, a, s / 2)), c = slope(along(state, b, s / 2)), d = slope(along(state, c, s));
      state = state.map((each, i) => each + (s / 6) * (a[i] + 2 * b[i] + 2 * c[i] + d[i]));
    }
    return [...unit(state.slice(0, 4)), ...state.slice(4)];
  }

  // Implicit Euler: J (w1 - w0) = h J w1 x w1, with one step of Newton's method, then a rotation by h w1. The matrix is that of
  // btRigidBody::computeGyroscopicImpulseImplicit_Body in Bullet. On the brick ammo.js differs by 7e-6 rad in 1 s: single precision.
  function losing(J, state) {
    const w = state.slice(4), L = w.map((each, i) => J[i] * each);
    const columns = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis, k) => {
      const a = cross(w, axis), b = cross(L, axis);
      return axis.map((each, i) => J[k] * each + h * (J[k] * a[i] - b[i]));
    });
    const gap = cross(w, L), volume = dot(columns[0], cross(columns[1], columns[2]));
    const change = (k) => (h * dot(gap, cross(columns[(k + 1) % 3], columns[(k + 2) % 3]))) / volume; // Cramer's rule
    const next = w.map((each, k) => each - change(k)), rate = hypot(...next), angle = h * rate;
    const turn = [...next.map((each) => (each * sin(angle / 2)) / (rate || 1)), cos(angle / 2)];
    return [...unit(times(state.slice(0, 4), turn)), ...next];
  }

  // The texts and the grades of values, each with the frame from which it holds.
  const sizes = (values, text, grade) =>
    values.map((each, k) => [k, text(each), grade(each)]).filter((each, k, all) => !k || each[1] !== all[k - 1][1]);
  const share = (each) => `${Math.round(100 * each)} %`;
  const shares = (values) => sizes(values.map((each) => each / values[0]), share, (each) => (abs(each - 1) < 0.005 ? "good" : "bad"));
  const rounded = (value, digits) => { // up, of the 15 digits that a number has for certain: as rounded_up in presentation.py
    const [all, power] = value.toExponential(14).replace(".", "").split("e");
    return Number(`${Number(all.slice(0, digits)) + /[1-9]/.test(all.slice(digits))}e${power - digits + 1}`);
  };
  const angle = (error) => { // as in reports/numbers.py
    const digits = [2, 3, 4].find((each) => rounded(error, each) <= Math.PI), up = rounded(error, digits ?? 4);
    return !digits ? "π" : up && up < 0.01 ? up.toExponential(digits - 1) : `${up}`;
  };
  const grade = (error) => (error < 1e-3 ? "good" : error < 0.1 ? "fair" : "bad"); // as LIMITS in reports/animation/frames.py
  const largest = (values) => {
    let top = 0;
    return sizes(values.map((each) => (top = Math.max(top, each))), angle, grade);
  };

  function compute(length, rate, disturbance) {
    const [a, b, c] = [1, 9, length ** 2], J = [b + c, a + c, a + b]; // of a box with sides 1 : 3 : length, kg m^2
    const size = [1, 3, length].map((each) => (2 * each) / hypot(1, 3, length));
    const start = [0, 0, 0, 1, 0, rate * disturbance, rate];
    const runs = [exact, losing].map((step) => {
      const states = [start];
      while (states.length < frames) states.push(step(J, states.at(-1)));
      const w = states.map((each) => each.slice(4)), L = w.map((each) => each.map((x, i) => J[i] * x));
      const energy = w.map((each, k) => dot(each, L[k]) / 2), momentum = L.map((each) => hypot(...each));
      return { q: states.map((each) => each.slice(0, 4)), L, energy, momentum };
    });
    const errors = runs[1].q.map((q, k) => { // the conjugate by components, and an angle that is accurate when small
      const [x, y, z, s] = times(q, runs[0].q[k].map((each, i) => (i < 3 ? -each : each)));
      return 2 * Math.atan2(hypot(x, y, z), abs(s));
    });
    const panels = runs.flatMap(({ q, L, energy, momentum }, k) => {
      const L_P = L.map((each) => each.map((x) => x / momentum[0])), L_W = L_P.map((each, n) => turn(q[n], each));
      return [
        { size, tip: [0, 0, 1.25], q: q.flat(), L: L_W.flat(), sizes: k ? [largest(errors)] : [] },
        { moments: J, L: L_P.flat(), sizes: [shares(energy), shares(momentum)] },
      ];
    });
    return { J, panels, runs };
  }

  function show() {
    const [length, rate, log] = sliders.length ? sliders.map((each) => Number(each.value)) : [2, 10, Math.log10(0.005)];
    const { J, panels, runs } = compute(length, rate, 10 ** log);
    motion.content = { duration, frames, truth: 0, colours, panels };
    motion.dispatchEvent(new Event("content"));
    if (!sliders.length) return;
    const moments = J.map((each) => each.toFixed(1)).join(", "), percent = Number((100 * 10 ** log).toPrecision(2));
    const texts = [`${moments} kg m²`, `${rate.toFixed(1)} rad/s`, `${percent} % of the rate`];
    for (const [k, slider] of sliders.entries()) {
      slider.ariaValueText = slider.parentElement.querySelector("output").textContent = texts[k];
    }
    const growth = ((J[0] - J[2]) * (J[2] - J[1])) / (J[0] * J[1]); // (exponent / rate)^2 of a small disturbance
    const axis = growth > 0 ? "intermediate axis: unstable" : `axis of the ${J[2] > J[0] ? "largest" : "smallest"} moment: stable`;
    const spin = abs(growth) < 1e-9 ? "Two moments are equal." : `Spin about the ${axis}.`;
    const pace = growth > 1e-9 ? ` A disturbance grows tenfold in ${(Math.log(10) / (rate * sqrt(growth))).toFixed(2)} s.` : "";
    const up = runs[0].L.map((each) => each[2] > 0), flips = up.filter((each, k) => k && each !== up[k - 1]).length;
    const [energy, momentum] = ["energy", "momentum"].map((name) => share(1 - runs[1][name].at(-1) / runs[1][name][0]));
    said.textContent = `${spin}${pace} In ${duration} s the body turns over ${flips} times. Implicit Euler loses ${energy} of the energy and ${momentum} of the momentum.`;
  }
  for (const slider of sliders) slider.addEventListener("input", show);
  show();
}
