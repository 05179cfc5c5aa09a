// Exact motions as a test of your engine: fill in `simulate`, then   rustc -O test.rs && ./test *.csv   (CC0)
use std::collections::HashMap;

const ORDER: f64 = 2.0; // the order of your integrator: 1, 2 or 4
const ANGLE: f64 = 0.01; // |w| h, rad: 0.1, 0.03 or 0.01
const SINGLE: f64 = 0.0; // 1 for single precision
const HAS: [&str; 5] = ["rotor", "torque", "damping", "fixed point", "orbit"]; // motions that need anything else are skipped

type State = [f64; 7]; // quaternion, scalar first, body to world; rates in body axes, rad/s
#[derive(Default)]
struct Motion {
    rows: HashMap<String, Vec<Vec<f64>>>, // the numbers of the lines of each key
    features: Vec<String>,
    mistakes: Vec<String>,
}
impl Motion {
    fn get(&self, key: &str) -> Vec<f64> {
        self.rows.get(key).map_or(vec![0.0; 9], |rows| rows[0].clone())
    }
}

// YOUR ENGINE: set up the body of the motion, and return its state after each `steps` steps of h seconds.
fn simulate(motion: &Motion, _h: f64, steps: usize, samples: usize) -> Vec<State> {
    let (_inertia, q, w) = (motion.get("inertia_B"), motion.get("quaternion_wxyz0"), motion.get("w_WB_B0"));
    let mut states = vec![];
    for _ in 0..samples {
        for _ in 0..steps {} // one step
        states.push([q[0], q[1], q[2], q[3], w[0], w[1], w[2]]);
    }
    states
}
// END

fn rotate(q: &[f64], v: &[f64]) -> Vec<f64> {
    let cross = |a: &[f64], b: &[f64], i: usize| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
    let u = &q[1..4];
    let uv: Vec<f64> = (0..3).map(|i| cross(u, v, i)).collect();
    (0..3).map(|i| v[i] + 2.0 * (q[0] * uv[i] + cross(u, &uv, i))).collect()
}

// Attitude, rad; rates, energy and momentum relative to the scales of the motion.
fn errors(m: &Motion, exact: &[f64], y: &State) -> [f64; 4] {
    let (inertia, rotor, scale) = (m.get("inertia_B"), m.get("rotor_momentum_B"), m.get("scale"));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, z)| x * z).sum::<f64>();
    let apart = |a: &[f64], b: &[f64], sign: f64| a.iter().zip(b).map(|(x, z)| (x - sign * z).powi(2)).sum::<f64>().sqrt();
    let w = &y[4..7];
    let body: Vec<f64> = (0..3).map(|i| dot(&inertia[3 * i..3 * i + 3], w)).collect();
    let energy = dot(&body, w) / 2.0 + m.get("weight")[0] * rotate(y, &m.get("com_B"))[2];
    let momentum = rotate(y, &(0..3).map(|i| body[i] + rotor[i]).collect::<Vec<f64>>());
    let q = apart(&y[..4], &exact[10..14], 1.0).min(apart(&y[..4], &exact[10..14], -1.0));
    [4.0 * (q / 2.0).min(1.0).asin(), apart(w, &exact[14..17], 1.0) / scale[0], (energy - exact[20]).abs() / scale[1],
     apart(&momentum, &exact[21..24], 1.0) / scale[2]]
}

// The largest errors with so many steps before each sample.
fn worst(m: &Motion, steps: usize) -> [f64; 4] {
    let exact = &m.rows["sample"];
    let states = simulate(m, exact[0][0] / steps as f64, steps, exact.len());
    let mut out = [0.0f64; 4];
    for (row, state) in exact.iter().zip(&states) {
        for (k, e) in errors(m, row, state).iter().enumerate() {
            out[k] = out[k].max(if e.is_nan() { f64::INFINITY } else { *e });
        }
    }
    out
}

const NEAR: f64 = 0.8; // sum of the squares of four logarithms, of errors over those of a mistake that explains them
struct Failure {
    name: String,
    near: Vec<(String, f64)>, // the mistakes that explain it, and their distances
    falls: f64,               // the exponent with which the error falls with the step
}

fn main() {
    let (mut failing, mut tested): (Vec<Failure>, usize) = (vec![], 0);
    for file in std::env::args().skip(1) {
        let mut m = Motion::default();
        for line in std::fs::read_to_string(&file).expect(&file).lines() {
            let fields: Vec<&str> = line.split(',').collect();
            let values = fields[1..].iter().map(|x| x.parse().unwrap_or(0.0)).collect();
            m.rows.entry(fields[0].to_string()).or_default().push(values);
            match fields[0] {
                "features" => m.features = fields[1..].iter().map(|x| x.to_string()).collect(),
                "catches" => m.mistakes.push(fields[1].to_string()),
                _ => {}
            }
        }
        if let Some(part) = m.features.iter().find(|each| !HAS.contains(&each.as_str())) {
            println!("{file}: skipped, it has {part}");
            continue;
        }
        tested += 1;
        let allowed = m.rows["tolerance"].iter().find(|row| row[0] == ORDER && row[1] == ANGLE).expect("ORDER and ANGLE");
        let limit: Vec<f64> = allowed[3..].iter().map(|x| x + SINGLE * m.get("single")[0]).collect();
        let (steps, found) = (allowed[2] as usize, worst(&m, allowed[2] as usize));
        let most = (0..4).max_by(|&a, &b| (found[a] / limit[a]).total_cmp(&(found[b] / limit[b]))).unwrap();
        let ratio = found[most] / limit[most];
        if ratio <= 1.0 {
            continue;
        }
        let mut near = vec![];
        for (name, known) in m.mistakes.iter().zip(m.rows.get("catches").unwrap_or(&vec![])) {
            let apart: f64 = (0..4).map(|k| (found[k].max(limit[k]) / known[1 + k].max(limit[k])).ln().powi(2)).sum();
            if apart < NEAR {
                near.push((name.clone(), apart));
            }
        }
        let half = worst(&m, 2 * steps)[most];
        let falls = if found[most] < f64::INFINITY && half > 0.0 { (found[most] / half).log2() } else { 0.0 };
        let name = ["attitude", "rates", "energy", "momentum"][most];
        let text = format!("{file}: {name} error {:.1e}, tolerance {:.1e}", found[most], limit[most]);
        if falls >= ORDER - 0.5 && (ratio <= 2.0 || near.is_empty()) {
            println!("{text}: {:.0} % above the tolerance, falls as h^{falls:.1}: right", 100.0 * (ratio - 1.0));
            continue;
        }
        println!("{text}");
        failing.push(Failure { name: file, near, falls });
    }

    println!("{} of {tested} motions failed", failing.len());
    let mut rest: Vec<&Failure> = failing.iter().collect();
    for _ in 0..3 { // the mistakes that explain most of the failing motions
        let mut votes: Vec<(&str, (usize, f64))> = vec![]; // in the order of the file
        for (name, apart) in rest.iter().flat_map(|each| &each.near) {
            match votes.iter_mut().find(|each| each.0 == name) {
                Some((_, vote)) => *vote = (vote.0 + 1, vote.1 - apart),
                None => votes.push((name, (1, -apart))),
            }
        }
        let Some((best, vote)) = votes.iter().rev().max_by(|a, b| a.1 .0.cmp(&b.1 .0).then(a.1 .1.total_cmp(&b.1 .1))) else { break };
        if 10 * vote.0 < failing.len() {
            break;
        }
        println!("\"{best}\" explains {} of them", vote.0);
        rest.retain(|each| each.near.iter().all(|(name, _)| name != best));
    }
    let mut falls: Vec<f64> = failing.iter().map(|each| each.falls).collect();
    falls.sort_by(f64::total_cmp);
    if let Some(order) = falls.get(falls.len() / 2).filter(|order| 2 * rest.len() > falls.len() && (0.5..ORDER - 0.5).contains(*order)) {
        println!("this program has order {order:.1}, {ORDER} was declared");
    }
    if !rest.is_empty() {
        let names: Vec<&str> = rest.iter().take(5).map(|each| each.name.as_str()).collect();
        println!("{} not explained by a mistake of the list: {}", rest.len(), names.join(", "));
    }
    std::process::exit((!failing.is_empty()) as i32);
}
