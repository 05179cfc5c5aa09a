const METHOD: &[Real] = &[];
type Real = f64;
const BOTH: &str = "no gyroscopic term + damping 0.05";
type V = [Real; 3];
type M = [V; 3];
const ONE: M = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
struct Body { j: M, k: M, r0: M, damping: M, rotor: V, torque_b: V, torque_w: V, arm: V, orbit: Real }
fn mistake() -> &'static str {
    static GIVEN: std::sync::OnceLock<String> = std::sync::OnceLock::new();
    GIVEN.get_or_init(|| std::env::var("MISTAKE").unwrap_or_default())
}
fn is(name: &str) -> bool { mistake() == name }
fn sign(zero: &str, minus: &str) -> Real { if is(zero) { 0.0 } else if is(minus) { -1.0 } else { 1.0 } }
fn vec(f: impl Fn(usize) -> Real) -> V { [f(0), f(1), f(2)] }
fn mat(f: impl Fn(usize, usize) -> Real) -> M { [vec(|k| f(0, k)), vec(|k| f(1, k)), vec(|k| f(2, k))] }
fn dot(a: &V, b: &V) -> Real { a[0] * b[0] + a[1] * b[1] + a[2] * b[2] }
fn cross(a: &V, b: &V) -> V { vec(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]) }
fn apply(a: &M, v: &V) -> V { vec(|i| dot(&a[i], v)) }
fn transpose(a: &M) -> M { mat(|i, k| a[k][i]) }
fn multiply(a: &M, b: &M) -> M { let t = transpose(b); mat(|i, k| dot(&a[i], &t[k])) }
fn add(a: &V, b: &V, scale: Real) -> V { vec(|i| a[i] + scale * b[i]) }
fn inverse(a: &M) -> M {
    let c = [cross(&a[1], &a[2]), cross(&a[2], &a[0]), cross(&a[0], &a[1])];
    let d = dot(&a[0], &c[0]);
    mat(|i, k| c[k][i] / d)
}
fn matrix(y: &[Real; 7]) -> M {
    let n = y[0] * y[0] + y[1] * y[1] + y[2] * y[2] + y[3] * y[3];
    let u = [y[1], y[2], y[3]];
    let h = [[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]];
    mat(|i, k| ((y[0] * y[0] - dot(&u, &u)) * ONE[i][k] + 2.0 * u[i] * u[k] + 2.0 * y[0] * h[i][k]) / n)
}
fn turning(y: &[Real; 7], w: &V) -> [Real; 4] {
    let u = [y[1], y[2], y[3]];
    let c = if is("wrong side") { cross(w, &u) } else { cross(&u, w) };
    [-dot(&u, w) / 2.0, (y[0] * w[0] + c[0]) / 2.0, (y[0] * w[1] + c[1]) / 2.0, (y[0] * w[2] + c[2]) / 2.0]
}
fn slope(body: &Body, t: Real, y: &[Real; 7]) -> [Real; 7] {
    let (w, r) = ([y[4], y[5], y[6]], matrix(y));
    let back = transpose(&r);
    let (mut j, mut k) = (body.j, body.k);
    if is("R I for R I R'") { j = multiply(&j, &r); k = inverse(&j); }
    if is("inertia in world axes") || is("inertia of the start") {
        let start = if is("inertia of the start") { body.r0 } else { ONE };
        j = multiply(&back, &multiply(&multiply(&start, &multiply(&j, &transpose(&start))), &r));
        k = inverse(&j);
    }
    let g = mat(|i, n| if is("diagonal gyroscopic term") && i != n { 0.0 } else { j[i][n] });
    let spin = cross(&add(&apply(&g, &w), &body.rotor, 1.0), &w);
    let mut torque = vec(|i| if is(BOTH) { 0.0 } else { sign("no gyroscopic term", "sign of the gyroscopic term") } * spin[i] + body.torque_b[i]);
    torque = add(&add(&torque, &apply(&back, &body.torque_w), 1.0), &apply(&body.damping, &w), -1.0);
    let (field, angle) = (sign("without the field", "sign of the field"), if is("turning of the field") { 0.0 } else { body.orbit * t });
    let u = apply(&back, &[angle.cos(), angle.sin(), 0.0]);
    torque = add(&torque, &cross(&r[2], &body.arm), field);
    torque = add(&torque, &cross(&u, &apply(&body.j, &u)), field * 3.0 * body.orbit * body.orbit);
    let (q, a) = (turning(y, &w), apply(&k, &torque));
    [q[0], q[1], q[2], q[3], a[0], a[1], a[2]]
}
fn step(body: &Body, t: Real, h: Real, start: &[Real; 7]) -> [Real; 7] {
    let s = METHOD[0] as usize;
    let (mut k, mut y) = (vec![[0.0 as Real; 7]; s], *start);
    let more = |y: &mut [Real; 7], k: &[Real; 7], a: Real| for n in 0..7 { y[n] += a * k[n] };
    for _ in 0..(if METHOD[1] == 0.0 && METHOD[s * s] == 0.0 { s } else { 30 }) {
        for i in 0..s {
            let (mut at, mut c) = (*start, 0.0);
            for j in 0..s { let a = METHOD[1 + i * s + j]; c += a; more(&mut at, &k[j], h * a); }
            k[i] = slope(body, t + c * h, &at);
        }
    }
    for j in 0..s { more(&mut y, &k[j], h * METHOD[1 + s * s + j]); }
    if is("attitude by normalisation") {
        let turn = turning(start, &[y[4], y[5], y[6]]);
        for n in 0..4 { y[n] = start[n] + h * turn[n]; }
    }
    if is("stale rates") {
        let w = [start[4], start[5], start[6]];
        let (turn, speed) = (turning(start, &w), dot(&w, &w).sqrt());
        for n in 0..4 { y[n] = start[n] * (h * speed / 2.0).cos() + turn[n] * 2.0 / speed * (h * speed / 2.0).sin(); }
    }
    let (size, speed) = ((y[0] * y[0] + y[1] * y[1] + y[2] * y[2] + y[3] * y[3]).sqrt(), (y[4] * y[4] + y[5] * y[5] + y[6] * y[6]).sqrt());
    let damping: Real = mistake().split("damping 0").nth(1).map_or(0.0, |x| x.parse().unwrap());
    let mut scale = (-damping * h).exp();
    if is("rate limit 100") && speed > 100.0 { scale = 100.0 / speed; }
    if is("sleep") && speed < 0.5 { scale = 0.0; }
    for n in 0..7 { if n < 4 { y[n] /= size } else { y[n] *= scale } }
    y
}
fn simulate(m: &Motion, h: f64, steps: usize, samples: usize) -> Vec<State> {
    let get = |x: [f64; 3]| -> V { vec(|i| x[i] as Real) };
    let square = |x: [f64; 9]| -> M { mat(|i, k| x[3 * i + k] as Real) };
    let products = sign("no products of inertia", "sign of the products of inertia");
    let inertia = square(m.inertia_B);
    let mut j = mat(|i, k| if i == k { inertia[i][k] } else { products * inertia[i][k] });
    if is("smallest moments") && j[0][0] < 1e-6 { j = mat(|i, k| 1e-6 * ONE[i][k]); }
    let torque = sign("without the torque", "sign of the torque");
    let (b, w) = if is("axes of the torque") { (get(m.torque_W), get(m.torque_B)) } else { (get(m.torque_B), get(m.torque_W)) };
    let (q, w0, com, rotor) = (m.quaternion_wxyz0, get(m.w_WB_B0), get(m.com_B), get(m.rotor_momentum_B));
    let mut y: [Real; 7] = [q[0] as Real, q[1] as Real, q[2] as Real, q[3] as Real, w0[0], w0[1], w0[2]];
    let body = Body {
        j, k: inverse(&j), r0: matrix(&y), orbit: m.orbit as Real, arm: vec(|i| m.weight as Real * com[i]),
        damping: if is("without the damping") { mat(|_, _| 0.0) } else { square(m.damping) },
        rotor: vec(|i| sign("without the rotor", "sign of the rotor") * rotor[i]), torque_b: vec(|i| torque * b[i]), torque_w: vec(|i| torque * w[i]),
    };
    let (mut t, mut states) = (0.0, vec![]);
    for i in 0..samples {
        for n in 0..steps {
            let size = if is("half a step late") && i + n == 0 { h as Real / 2.0 } else { h as Real };
            y = step(&body, t, size, &y);
            t += size;
        }
        let mut state = [0.0f64; 7];
        let v = apply(&matrix(&y), &[y[4], y[5], y[6]]);
        for n in 0..7 { state[n] = y[n] as f64; }
        for n in 0..3 {
            if is("transposed") { state[1 + n] *= -1.0; }
            if is("reversed rates") { state[4 + n] *= -1.0; }
            if is("world rates") { state[4 + n] = v[n] as f64; }
            if mistake().contains("order xyzw") { state[n] = y[n + 1] as f64; state[3] = y[0] as f64; }
        }
        states.push(state);
    }
    states
}
