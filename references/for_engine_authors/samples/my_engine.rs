use std::{io, time::Instant}; // rustc -O my_engine.rs
fn get(line: &str, name: &str) -> Vec<f64> { // the numbers of a field
    let key = format!("\"{name}\": ");
    let rest = line[line.find(&key).unwrap() + key.len()..].trim_start_matches('[');
    rest.split(',').map_while(|text| text.trim().trim_end_matches([']', '}']).parse().ok()).collect()
}
fn integrate(line: &str, calls: usize) -> (Vec<[f64; 4]>, Vec<[f64; 3]>) { // semi-implicit Euler
    let (q0, w0, j, steps) = (get(line, "q0"), get(line, "w0"), get(line, "moments"), get(line, "steps"));
    let (h, mut q, mut w) = (get(line, "dt")[0], vec![], vec![]);
    for _ in 0..calls {
        let (mut a, mut b, mut c, mut d, mut x, mut y, mut z) = (q0[0], q0[1], q0[2], q0[3], w0[0], w0[1], w0[2]);
        (q, w) = (vec![], vec![]);
        for n in 0..=steps[steps.len() - 1] as usize {
            if n as f64 == steps[q.len()] { q.push([a, b, c, d]); w.push([x, y, z]); }
            let (u, v) = (x + h * (j[1] - j[2]) * y * z / j[0], y + h * (j[2] - j[0]) * z * x / j[1]);
            (x, y, z) = (u, v, z + h * (j[0] - j[1]) * x * y / j[2]);
            let (e, f) = (a - h / 2. * (b * x + c * y + d * z), b + h / 2. * (a * x + c * z - d * y));
            let (g, i) = (c + h / 2. * (a * y + d * x - b * z), d + h / 2. * (a * z + b * y - c * x));
            let norm = (e * e + f * f + g * g + i * i).sqrt();
            (a, b, c, d) = (e / norm, f / norm, g / norm, i / norm);
        }
    }
    (q, w)
}
fn main() {
    let mut runs: Vec<String> = vec![];
    for line in io::stdin().lines().map(Result::unwrap) {
        let (does, start) = (|what: &str| line.contains(&format!("\"do\": \"{what}\"")), Instant::now());
        let run = |calls| integrate(&runs[get(&line, "run")[0] as usize], calls);
        println!("{}", if does("hello") { r#"{"protocol": 1, "program": "Rust", "version": "1", "framing": "lines"}"#.into() }
            else if line.contains("\"free\": false") { r#"{"error": "unsupported", "message": "only free bodies"}"#.into() }
            else if does("prepare") { format!("{{\"run\": {}}}", runs.len()) }
            else if does("run") { let (q, w) = run(1); format!("{{\"q\": {q:?}, \"w\": {w:?}}}") } // these texts are JSON
            else { run(get(&line, "calls")[0] as usize); format!("{{\"seconds\": {}}}", start.elapsed().as_secs_f64()) });
        if does("prepare") { runs.push(line) }
    }
}
