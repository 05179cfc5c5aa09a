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
    needs: Vec<String>,
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

fn main() {
    let (mut failed, files) = (0, std::env::args().skip(1).collect::<Vec<_>>());
    for file in &files {
        let mut m = Motion::default();
        for line in std::fs::read_to_string(file).expect(file).lines() {
            let fields: Vec<&str> = line.split(',').collect();
            let values = fields[1..].iter().map(|x| x.parse().unwrap_or(0.0)).collect();
            m.rows.entry(fields[0].to_string()).or_default().push(values);
            match fields[0] {
                "needs" => m.needs = fields[1..].iter().map(|x| x.to_string()).collect(),
                "catches" => m.mistakes.push(fields[1].to_string()),
                _ => {}
            }
        }
        if let Some(part) = m.needs.iter().find(|each| !HAS.contains(&each.as_str())) {
            println!("{file}: skipped, it needs {part}");
            continue;
        }
        let allowed = m.rows["tolerance"].iter().find(|row| row[0] == ORDER && row[1] == ANGLE).expect("ORDER and ANGLE");
        let limit: Vec<f64> = allowed[3..].iter().map(|x| x + SINGLE * m.get("single")[0]).collect();
        let exact = &m.rows["sample"];
        let states = simulate(&m, exact[0][0] / allowed[2], allowed[2] as usize, exact.len());
        let mut worst = [0.0f64; 4];
        for (row, state) in exact.iter().zip(&states) {
            for (k, e) in errors(&m, row, state).iter().enumerate() {
                worst[k] = worst[k].max(if e.is_nan() { f64::INFINITY } else { *e });
            }
        }
        let most = (0..4).max_by(|&a, &b| (worst[a] / limit[a]).total_cmp(&(worst[b] / limit[b]))).unwrap();
        if worst[most] <= limit[most] {
            continue;
        }
        let (mut best, mut advice) = (0.5, "no mistake of the list does this".to_string());
        for (name, known) in m.mistakes.iter().zip(&m.rows["catches"]) {
            let apart: f64 = (0..4).map(|k| (worst[k].max(limit[k]) / known[4 + k].max(limit[k])).ln().powi(2)).sum();
            if apart < best {
                (best, advice) = (apart, format!("this is what a program does with: {name}"));
            }
        }
        let name = ["attitude", "rates", "energy", "momentum"][most];
        println!("{file}: {name} error {:.1e}, tolerance {:.1e}; {advice}", worst[most], limit[most]);
        failed += 1;
    }
    println!("{failed} of {} motions failed", files.len());
    std::process::exit((failed > 0) as i32);
}
