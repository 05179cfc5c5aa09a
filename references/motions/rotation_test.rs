// Exact rotations as a test of your engine (CC0). Fill in `simulate`, then, in the folder `tests` of a crate, run
//   cargo test      or, alone,   rustc -O rotation_test.rs && ./rotation_test
// With ./rotation_test --record known.txt, today's errors become known errors: a later run fails only if a motion gets worse.
#![allow(non_snake_case, dead_code)]
use std::io::Write;

const ORDER: u32 = 2; // the order of your integrator: 1, 2 or 4 (2 for order 3)
const ANGLE: f64 = 0.01; // |w| h in rad; 0.03 and 0.1 with the files of all motions
const SINGLE: bool = false; // single precision
const HAS: &str = ""; // what `simulate` reads of `m`: "rotor, torque, damping, fixed point, orbit"; other motions are skipped

type State = [f64; 7]; // quaternion, scalar first, body to world; rates in body axes, rad/s

// YOUR ENGINE: set up the body of the motion, and return its state after each `steps` steps of h seconds.
fn simulate(m: &Motion, _h: f64, steps: usize, samples: usize) -> Vec<State> {
    let (q, w) = (m.quaternion_wxyz0, m.w_WB_B0); // m.inertia_B is the inertia, by rows
    let mut states = vec![];
    for _ in 0..samples {
        for _ in 0..steps {} // one step
        states.push([q[0], q[1], q[2], q[3], w[0], w[1], w[2]]);
    }
    states
}
// END

#[derive(Default)]
struct Motion {
    inertia_B: [f64; 9],
    quaternion_wxyz0: [f64; 4],
    w_WB_B0: [f64; 3],
    rotor_momentum_B: [f64; 3],
    torque_B: [f64; 3],
    torque_W: [f64; 3],
    damping: [f64; 9],
    weight: f64,
    com_B: [f64; 3],
    orbit: f64,
    name: String,
    features: Vec<String>,
    scale: [f64; 3],
    single: f64,
    samples: Vec<(f64, State)>,
    tolerance: Vec<Vec<f64>>,
    catches: Vec<(String, Vec<f64>)>,
}

struct Check {
    name: String,
    free: bool,
    found: [f64; 4],
    limit: [f64; 4],
    most: usize,              // which error is largest, of `NAMES`
    near: Vec<(String, f64)>, // the mistakes that explain it, and their distances
    order: Option<f64>,
    note: String,
    failed: bool,
    mistake: String,
}

const NAMES: [&str; 4] = ["attitude", "rates", "energy", "momentum"];
const NEAR: f64 = 0.2; // mean square of logarithms: errors over the errors of a mistake that explains them
const LARGE: f64 = 0.08; // errors that show two mistakes
const LARGEST: f64 = 1e6; // instead of errors that are not finite
const FEATURES: &str = "rotor, torque, damping, fixed point, orbit";
const HEADER: &str = "# Known errors on exact motions. A later run fails if a motion is worse or has another mistake. Written by --record.";

type Known = Vec<(String, [f64; 2], String)>; // motion; attitude and rates error; mistake

// Return the motions of lines with a key and its values.
fn read(text: &str) -> Vec<Motion> {
    let mut motions: Vec<Motion> = vec![];
    for line in text.lines() {
        let (key, values) = line.trim().split_once(',').unwrap_or((line, ""));
        let fields: Vec<&str> = values.split(',').collect();
        let parse = |texts: &[&str]| -> Vec<f64> { texts.iter().map(|x| x.parse().unwrap_or(0.0)).collect() };
        if key == "name" {
            motions.push(Motion { name: values.to_string(), ..Default::default() });
        }
        if key == "mistake" {
            for (m, field) in motions.iter_mut().zip(&fields[1..]).filter(|(_, field)| !field.is_empty()) {
                m.catches.push((fields[0].to_string(), parse(&field.split(' ').collect::<Vec<_>>())));
            }
        }
        let (Some(m), row) = (motions.last_mut(), parse(&fields)) else { continue };
        match key {
            "features" => m.features = fields.iter().filter(|x| !x.is_empty()).map(|x| x.to_string()).collect(),
            "inertia_B" => m.inertia_B.copy_from_slice(&row),
            "quaternion_wxyz0" => m.quaternion_wxyz0.copy_from_slice(&row),
            "w_WB_B0" => m.w_WB_B0.copy_from_slice(&row),
            "rotor_momentum_B" => m.rotor_momentum_B.copy_from_slice(&row),
            "torque_B" => m.torque_B.copy_from_slice(&row),
            "torque_W" => m.torque_W.copy_from_slice(&row),
            "damping" => m.damping.copy_from_slice(&row),
            "weight" => m.weight = row[0],
            "com_B" => m.com_B.copy_from_slice(&row),
            "orbit" => m.orbit = row[0],
            "scale" => m.scale.copy_from_slice(&row),
            "single" => m.single = row[0],
            "tolerance" => m.tolerance.push(row),
            "catches" => m.catches.push((fields[0].to_string(), parse(&fields[1..]))),
            "sample" => { // files have a matrix before the quaternion, and more after the rates
                let q = if row.len() > 8 { 10 } else { 1 };
                let mut state = [0.0; 7];
                state.copy_from_slice(&row[q..q + 7]);
                m.samples.push((row[0], state));
            }
            _ => {}
        }
    }
    motions
}

fn rotate(q: &[f64], v: &[f64]) -> Vec<f64> {
    let cross = |a: &[f64], b: &[f64], i: usize| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
    let uv: Vec<f64> = (0..3).map(|i| cross(&q[1..4], v, i)).collect();
    (0..3).map(|i| v[i] + 2.0 * (q[0] * uv[i] + cross(&q[1..4], &uv, i))).collect()
}

// Return the energy, and the momentum in world axes.
fn invariants(m: &Motion, y: &State) -> (f64, Vec<f64>) {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, z)| x * z).sum::<f64>();
    let mut L: Vec<f64> = m.inertia_B.chunks(3).map(|row| dot(row, &y[4..])).collect();
    let energy = dot(&L, &y[4..]) / 2.0 + m.weight * rotate(y, &m.com_B)[2];
    L.iter_mut().zip(m.rotor_momentum_B).for_each(|(x, h)| *x += h);
    (energy, rotate(y, &L))
}

// Return the largest errors of attitude (rad), rates, energy and momentum, with so many steps before each sample.
fn worst(m: &Motion, steps: usize) -> Result<[f64; 4], String> {
    let states = simulate(m, m.samples[0].0 / steps as f64, steps, m.samples.len());
    if states.len() != m.samples.len() {
        return Err(format!("{}: simulate returned {} states, expected {}", m.name, states.len(), m.samples.len()));
    }
    let apart = |a: &[f64], b: &[f64], sign: f64| a.iter().zip(b).map(|(x, z)| (x - sign * z).powi(2)).sum::<f64>().sqrt();
    let mut out = [0.0f64; 4];
    for (y, (_, exact)) in states.iter().zip(&m.samples) {
        let ((E, L), (E0, L0)) = (invariants(m, y), invariants(m, exact));
        let (plus, minus) = (apart(&y[..4], &exact[..4], 1.0) / 2.0, apart(&y[..4], &exact[..4], -1.0) / 2.0);
        let q = if plus > minus { minus } else { plus };
        let angle = 4.0 * (if q > 1.0 { 1.0 } else { q }).asin();
        let now = [angle, apart(&y[4..], &exact[4..], 1.0) / m.scale[0], (E - E0).abs() / m.scale[1], apart(&L, &L0, 1.0) / m.scale[2]];
        for (x, e) in out.iter_mut().zip(now) {
            *x = if e < LARGEST { x.max(e) } else { LARGEST };
        }
    }
    Ok(out)
}

// Run a motion, and return its errors, the mistakes that explain them, and the order if the body is free.
fn check(m: &Motion) -> Result<Check, String> {
    let declared = |row: &&Vec<f64>| row[0] == ORDER as f64 && row[1] == ANGLE;
    let Some(row) = m.tolerance.iter().find(declared) else {
        return Err(format!("{} has no tolerance for order {ORDER} and |w| h = {ANGLE} rad", m.name));
    };
    let (steps, free, mut limit) = (row[2] as usize, m.features.is_empty(), [0.0; 4]);
    (0..4).for_each(|k| limit[k] = row[3 + k] + if SINGLE { m.single } else { 0.0 });
    let found = worst(m, steps)?;
    let most = (0..4).fold(0, |most, k| if found[k] / limit[k] > found[most] / limit[most] { k } else { most });
    let (ratio, mut order, mut falls, mut near, mut note) = (found[most] / limit[most], None, 0.0, vec![], String::new());
    if free || ratio > 1.0 {
        let half = worst(m, 2 * steps)?;
        if free && found[0] < LARGEST && half[0] > (if SINGLE { m.single } else { 1e-11 }) { // above rounding
            order = Some((found[0] / half[0]).log2().max(0.0));
        }
        if found[most] < LARGEST && half[most] > 0.0 {
            falls = (found[most] / half[most]).log2();
        }
    }
    if ratio > 1.0 {
        for (name, known) in &m.catches {
            let apart = (0..known.len()).map(|k| (found[k].max(limit[k]) / known[k].max(limit[k])).ln().powi(2)).sum::<f64>() / known.len() as f64;
            if apart < NEAR {
                near.push((name.clone(), apart));
            }
        }
        if falls >= ORDER as f64 - 0.5 && (ratio <= 2.0 || near.is_empty()) {
            note = format!(": {:.0} % above the tolerance, falls as h^{falls:.1}: right", 100.0 * (ratio - 1.0));
        } else if near.is_empty() { // a large error of the attitude alone, or of the rates alone, is still there beside another mistake
            for (name, known) in &m.catches {
                let k = usize::from(known[0] < known[1]);
                if known[1 - k] == 0.0 && known[k] > LARGE && (found[k].max(limit[k]) / known[k]).ln().abs() < 0.03 {
                    near.push((name.clone(), NEAR));
                }
            }
        }
    }
    let (failed, name) = (ratio > 1.0 && note.is_empty(), m.name.clone());
    Ok(Check { name, free, found, limit, most, near, order, note, failed, mistake: String::new() })
}

// Name the mistake of each motion that fails, those that explain most motions first, and return lines about them.
fn summary(failing: Vec<&mut Check>, whole: &str, measured: Option<f64>) -> Vec<String> {
    let (failed, mut rest, mut lines) = (failing.len(), failing, vec![]);
    for r in rest.iter_mut() {
        r.mistake = r.near.iter().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(String::new(), |best| best.0.clone());
    }
    for _ in 0..3 {
        let mut votes: Vec<(String, usize, f64)> = vec![];
        for (name, apart) in rest.iter().flat_map(|r| &r.near) {
            match votes.iter_mut().find(|vote| &vote.0 == name) {
                Some(vote) => (vote.1, vote.2) = (vote.1 + 1, vote.2 - apart),
                None => votes.push((name.clone(), 1, -apart)),
            }
        }
        let Some((best, n, _)) = votes.into_iter().rev().max_by(|a, b| a.1.cmp(&b.1).then(a.2.total_cmp(&b.2))) else { break };
        if 10 * n < failed {
            break;
        }
        lines.push(format!("\"{best}\" explains {n} of {whole}"));
        rest.retain_mut(|r| {
            let left = r.near.iter().all(|(name, _)| *name != best);
            if !left {
                r.mistake = best.clone();
            }
            left
        });
    }
    if let Some(order) = measured.filter(|order| 2 * rest.len() > failed && (0.5..ORDER as f64 - 0.5).contains(order)) {
        lines.push(format!("this program has order {order:.1}, {ORDER} was declared"));
    }
    if !rest.is_empty() {
        let names: Vec<&str> = rest.iter().take(5).map(|r| r.name.as_str()).collect();
        lines.push(format!("{} not explained by a mistake: {}", rest.len(), names.join(", ")));
        lines.push("What now: references/motions/my_engine_fails.md of conservative-rotation".to_string());
    }
    lines
}

// Return a number as 1.2e-05.
fn scientific(x: f64, digits: usize) -> String {
    let text = format!("{x:.*e}", digits - 1);
    let (number, exponent) = text.split_once('e').unwrap();
    format!("{number}e{}{:02}", if exponent.starts_with('-') { '-' } else { '+' }, exponent.trim_start_matches('-').parse::<u32>().unwrap())
}

// Return a number with so many digits.
fn short(x: f64, digits: usize) -> String {
    if !(0.01..10.0).contains(&x) {
        return scientific(x, digits);
    }
    format!("{x:.*}", (digits as i32 - 1 - x.log10().floor() as i32) as usize)
}

// Return an error in two digits of the three that are recorded, so that the same number looks the same.
fn two(x: f64) -> String {
    if x < LARGEST { scientific(scientific(x, 3).parse().unwrap(), 2) } else { "not finite".to_string() }
}

fn two_with_unit(x: f64, k: usize) -> String {
    two(x) + if k == 0 && x < LARGEST { " rad" } else { "" }
}

fn error(r: &Check, k: usize) -> String {
    format!("{}: {} error {}", r.name, NAMES[k], two_with_unit(r.found[k], k))
}

fn settings() -> String {
    format!("order {ORDER}, {ANGLE} rad, {}", if SINGLE { "single" } else { "double" })
}

fn or_none(mistake: &str) -> &str {
    if mistake.is_empty() { "no known mistake" } else { mistake }
}

// Return the order and the errors of a file of known errors.
fn read_known(path: &str) -> Result<(Option<f64>, Known), String> {
    let text = std::fs::read_to_string(path).map_err(|_| format!("{path}: cannot be read. Write it with --record {path}"))?;
    let (mut order, mut known, mut then) = (None, vec![], None);
    for (n, line) in text.lines().map(str::trim).enumerate() {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |i: usize| fields.get(i).and_then(|x| x.parse::<f64>().ok());
        let good = match (fields[0], number(1), number(2), number(3)) {
            ("settings", Some(order), Some(angle), _) if fields.len() == 4 => {
                then = Some(format!("order {order}, {angle} rad, {}", fields[3]));
                true
            }
            ("order", Some(value), _, _) => {
                order = Some(value);
                true
            }
            ("motions", _, Some(attitude), Some(rates)) if fields.len() == 5 => {
                known.push((fields[1].to_string(), [attitude, rates], fields[4].to_string()));
                true
            }
            _ => line.is_empty() || line.starts_with('#'),
        };
        if !good {
            return Err(format!("{path}: line {} is not of this test: {line}. Record again: --record {path}", n + 1));
        }
    }
    match then {
        None => Err(format!("{path}: not a file of known errors. Write another one with --record")),
        Some(then) if then != settings() => Err(format!("{path}: recorded with {then}; now {}: record again", settings())),
        _ => Ok((order, known)),
    }
}

fn write_known(path: &str, results: &[Check], order: Option<f64>) -> Result<(), String> {
    let old = std::path::Path::new(path).exists().then(|| std::fs::read_to_string(path).unwrap_or_default());
    if old.is_some_and(|text| !text.starts_with(&HEADER[..31])) {
        return Err(format!("{path}: not a file of known errors, and not replaced. Choose another name"));
    }
    let mut text = format!("{HEADER}\nsettings,{ORDER},{ANGLE},{}\n", if SINGLE { "single" } else { "double" });
    if let Some(order) = order {
        text += &format!("order,{order:.2}\n");
    }
    for r in results {
        text += &format!("motions,{},{},{},{}\n", r.name, short(r.found[0], 3), short(r.found[1], 3), r.mistake);
    }
    std::fs::write(path, text).map_err(|_| format!("{path}: cannot be written"))
}

// Return the lines of a run with known errors, and the number of motions that are worse.
fn compare(results: &mut [Check], order: Option<f64>, path: &str, skipped: &[String]) -> Result<(Vec<String>, usize), String> {
    let (before, known) = read_known(path)?;
    let (mut lines, mut mistakes): (_, Vec<(String, usize)>) = (vec![], vec![]);
    let find = |r: &Check| known.iter().find(|each| each.0 == r.name);
    let is_same = |r: &Check| find(r).is_some_and(|was| if was.2.is_empty() { r.near.is_empty() } else { r.near.iter().any(|each| each.0 == was.2) });
    let changed = |r: &Check, sign: f64| -> Vec<usize> { // errors that are larger, or smaller; recorded numbers have three digits
        find(r).map_or(vec![], |was| (0..2).filter(|&k| sign * (r.found[k] - was.1[k]) > 0.01 * was.1[k] + r.limit[k]).collect())
    };
    let is_better = |r: &Check| changed(r, 1.0).is_empty() && !changed(r, -1.0).is_empty();
    let is_new = |r: &Check| r.failed && !(is_better(r) || (is_same(r) && changed(r, 1.0).is_empty()));
    let failing: Vec<&mut Check> = results.iter_mut().filter(|r| is_new(r)).collect();
    let mut new = failing.len();
    let about = summary(failing, &format!("{new} new failures"), order);
    for r in results.iter() {
        let mistake = or_none(&r.mistake);
        let Some(was) = find(r) else {
            if r.failed {
                lines.push(format!("{}, tolerance {}, not recorded; {mistake}", error(r, r.most), two(r.limit[r.most])));
            }
            continue;
        };
        if is_new(r) {
            let k = usize::from(changed(r, 1.0) == [1]);
            let other = if is_same(r) { String::new() } else { format!(", was {}", or_none(&was.2)) };
            lines.push(format!("{}, was {}; {mistake}{other}", error(r, k), two(was.1[k])));
            continue;
        }
        if r.failed {
            let name = if is_same(r) { or_none(&was.2) } else { mistake };
            match mistakes.iter_mut().find(|each| each.0 == name) {
                Some(each) => each.1 += 1,
                None => mistakes.push((name.to_string(), 1)),
            }
        }
        let lower = changed(r, -1.0).into_iter().find(|&k| is_better(r) && two(was.1[k]) != two(r.found[k]));
        if let Some(k) = lower {
            let other = if r.failed && !is_same(r) { format!(", now {mistake}") } else { String::new() };
            let (a, b, rates) = (two(was.1[k]), two_with_unit(r.found[k], k), ["", " (rates)"][k]);
            lines.push(format!("better: {}, {a} to {b}{rates}{other}: record again to tighten", r.name));
        }
    }
    for (name, _, _) in known.iter().filter(|each| results.iter().all(|r| r.name != each.0)) {
        lines.push(format!("{name}: was tested, is {} now: record again", if skipped.contains(name) { "skipped" } else { "not there" }));
        new += 1;
    }
    lines.extend(about);
    mistakes.sort_by_key(|each| -(each.1 as i64));
    let each: Vec<String> = mistakes.iter().map(|(name, n)| format!("{name}: {n}")).collect();
    let text = if each.is_empty() { String::new() } else { format!(" ({})", each.join(", ")) };
    lines.push(format!("known errors of {path}: {}{text}, new failures: {new}", mistakes.iter().map(|each| each.1).sum::<usize>()));
    let (mut a, mut b, mut parts) = (0.0f64, 0.0f64, vec![]);
    for r in results.iter().filter(|r| r.free) {
        if let Some(was) = find(r) {
            (a, b) = (a.max(was.1[0]), b.max(r.found[0]));
        }
    }
    if short(a, 2) != short(b, 2) && (b - a).abs() > 0.01 * a && a.max(b) < LARGEST && (b > a || new == 0) {
        parts.push(format!("attitude error {} to {} rad", short(a, 2), short(b, 2)));
    }
    if let (Some(a), Some(b)) = (before, order) {
        if (a - b).abs() >= 0.2 {
            parts.push(format!("order {a:.1} to {b:.1}"));
        }
    }
    let mut text = parts.join(", ");
    if let Some(first) = results.iter().find(|r| is_new(r)) {
        text += &format!("{}first bad motion: {} ({})", if text.is_empty() { "" } else { "; " }, first.name, or_none(&first.mistake));
    }
    if !text.is_empty() {
        lines.push(format!("free rotation at your step: {text}"));
    }
    Ok((lines, new))
}

// Test the motions and return whether they are right, or why the test is not possible.
fn run(arguments: &[String]) -> Result<bool, String> {
    let has: Vec<&str> = HAS.split(',').map(str::trim).filter(|part| !part.is_empty()).collect();
    if let Some(part) = has.iter().find(|part| FEATURES.split(", ").all(|each| each != **part)) {
        return Err(format!("HAS: got {part}; allowed: {FEATURES}"));
    }
    let asked = |name: &str| std::env::var(name).ok().filter(|path| !path.is_empty());
    let (mut record, mut known) = (asked("ROTATION_RECORD"), asked("ROTATION_KNOWN"));
    let (mut motions, mut values) = (vec![], arguments.iter());
    while let Some(each) = values.next() {
        if each == "--record" || each == "--known" {
            let path = values.next().ok_or(format!("{each}: expected the name of a file"))?;
            *(if each == "--record" { &mut record } else { &mut known }) = Some(path.clone());
            continue;
        }
        let mut files = vec![std::path::PathBuf::from(each)];
        if let Ok(folder) = std::fs::read_dir(each) {
            files = folder.flatten().map(|file| file.path()).filter(|path| path.extension().is_some_and(|end| end == "csv")).collect();
            files.sort();
        }
        for file in files {
            let expected = || format!("{each}: expected --record FILE, --known FILE, a folder of motions or CSV files");
            let new = read(&std::fs::read_to_string(&file).map_err(|_| expected())?);
            if new.is_empty() {
                return Err(format!("{}: a file without a motion", file.display()));
            }
            motions.extend(new);
        }
    }
    if record.is_some() && known.is_some() {
        return Err("record and known are both given: give one of them".to_string());
    }
    if record.is_none() && known.is_none() && std::path::Path::new("known.txt").exists() {
        known = Some("known.txt".to_string());
    }
    if motions.is_empty() {
        motions = read(MOTIONS);
    }
    let mut out = std::io::stdout(); // print! would be hidden by cargo test
    let mut say = |text: &str| writeln!(out, "{text}").unwrap();
    let (mut results, mut skipped) = (vec![], vec![]);
    for m in &motions {
        match m.features.iter().find(|part| !has.contains(&part.as_str())) {
            Some(part) => {
                say(&format!("{}: skipped, it has {part}", m.name));
                skipped.push(m.name.clone());
            }
            None => results.push(check(m)?),
        }
    }
    let mut orders: Vec<f64> = results.iter().filter_map(|r| r.order).collect();
    orders.sort_by(f64::total_cmp);
    let order = orders.get(orders.len() / 2).copied();
    let failing: Vec<&mut Check> = results.iter_mut().filter(|r| r.failed).collect();
    let failed = failing.len();
    let about = summary(failing, "them", order);
    for r in results.iter().filter(|r| !r.note.is_empty() || (r.failed && known.is_none())) {
        let text = if r.failed { format!("; {}", or_none(&r.mistake)) } else { r.note.clone() };
        say(&format!("{}, tolerance {}{text}", error(r, r.most), two(r.limit[r.most])));
    }
    if let Some(path) = known {
        let (lines, new) = compare(&mut results, order, &path, &skipped)?;
        lines.iter().for_each(|line| say(line));
        return Ok(new == 0);
    }
    say(&format!("{failed} of {} motions failed", results.len()));
    about.iter().for_each(|line| say(line));
    if let Some(path) = record {
        write_known(&path, &results, order)?;
        let used = std::fs::canonicalize("known.txt").ok() == std::fs::canonicalize(&path).ok();
        let hint = if used { String::new() } else { format!(". The next run needs --known {path} (or ROTATION_KNOWN)") };
        say(&format!("{path}: {} motions recorded, {failed} known errors{hint}", results.len()));
        return Ok(true);
    }
    if failed > 0 {
        say("Known and accepted? --record known.txt (or ROTATION_RECORD=known.txt): then only new failures fail");
    }
    Ok(failed == 0)
}

// BEGIN MOTIONS
const MOTIONS: &str = "
name,brick_flip
inertia_B,13,0,0,0,5,0,0,0,10
quaternion_wxyz0,1,0,0,0
w_WB_B0,0,.05,10
sample,.04,.980066080285,-7.7260487e-5,.00099432641,.198669282028,-.00773973082,.05092592027,9.99999377004
sample,.08,.921059033938,-.000313002448,.001953836648,.389417950989,-.01576610603,.0537379694,9.99997414868
sample,.12,.825331324351,-.00071844221,.002839874903,.564641146212,-.02437638132,.05854028038,9.99993820218
sample,.16,.696699404582,-.001310044891,.003606267964,.717352924487,-.03388942615,.06551068157,9.99988055599
sample,.2,.540291612426,-.002106144642,.004195995668,.841464753461,-.0446575226,.07490727032,9.99979259124
scale,10.0002,500.006,100
tolerance,1,.01,40,.00022,.00028,1.9e-6,.00015
tolerance,2,.01,40,.00017,5.6e-6,1.1e-6,2e-6
tolerance,4,.01,40,2.8e-9,1.7e-10,1.1e-10,1.4e-10
single,.00035
name,golden_4
features,fixed point
inertia_B,37.569567086791935,0,0,0,24.42047900665016,0,0,0,49.74541379718716
quaternion_wxyz0,.080676695026,.243425168124,.406750890403,.87680623376
w_WB_B0,-.493501866735,1.039660622419,.000416869186
weight,3010
com_B,.02361198596771947,-.01514681660749079,.003072647492940911
sample,.092,.067689278842,.195298596414,.39279062573,.896098289312,-.406698404626,1.185777743939,-.137063569628
sample,.184,.056257799272,.13796008191,.383108854263,.911608293954,-.302613112942,1.352292838003,-.26434224599
sample,.276,.045877224471,.070871031907,.377762999676,.922045385644,-.180760141687,1.534728636918,-.378906739634
sample,.368,.036109081052,-.006128208929,.376666328191,.925624684485,-.041787400584,1.726675384467,-.477850895476
scale,1.79206,42.116,48.4305
tolerance,1,.01,20,.022,.017,.051,.026
tolerance,2,.01,20,7.2e-5,5.8e-5,.00014,9.3e-5
tolerance,4,.01,20,8e-10,6.3e-10,5.7e-10,1.1e-9
single,.00013
name,golden_9
inertia_B,3.330073724153789,0,0,0,1.354784666276132,0,0,0,4.479344421805398
quaternion_wxyz0,-.470821233501,-.862831436986,-.037843352356,-.180047655126
w_WB_B0,-34.32588597222,21.20929544084,-40.60791817033
sample,.0034,-.527739029423,-.822765111727,-.106497802656,-.182228718314,-31.28011371377,25.10961113494,-41.7482365852
sample,.0068,-.574569851351,-.776359009178,-.180150498896,-.186230965562,-27.63998986798,28.71238447059,-42.9385064686
sample,.0102,-.609868156415,-.724654963895,-.258141186148,-.19052334006,-23.42419341637,31.92228858191,-44.10092148237
sample,.0136,-.632536701804,-.668800542901,-.339402991611,-.19341345344,-18.6776624159,34.63677355977,-45.15319950195
scale,59.8947,5959.8,216.745
tolerance,1,.01,20,.0066,.0087,.0043,.0065
tolerance,2,.01,20,8.6e-5,.00015,4.7e-5,6.4e-5
tolerance,4,.01,20,2.9e-9,3.8e-9,6.4e-10,2.3e-9
single,.00017
name,separatrix_turned
inertia_B,.8316,-.005554,-.1469,-.005554,.8775,-.0191,-.1469,-.0191,.5895
quaternion_wxyz0,.393215738015,.327179507203,.169092772836,-.842462217324
w_WB_B0,1.062,.1578,-.1296
sample,.092,.370537960828,.350827234519,.132385642469,-.849762268386,1.063966219695,.143831719492,-.12971383988
scale,1.08145,.504512,.941297
tolerance,1,.01,10,.00065,.0011,.00017,.00064
tolerance,2,.01,10,6.6e-5,.00011,1.8e-5,6.5e-5
tolerance,4,.01,10,2.7e-10,2.6e-10,1.1e-10,1.6e-10
single,3.6e-5
name,tiny
inertia_B,9.455e-10,0,0,0,9.151e-10,0,0,0,1.048e-9
quaternion_wxyz0,.112992486249,.491967285263,-.845943746611,.171988563141
w_WB_B0,.5509,-.6398,-.5359
sample,.1,.076857449693,.522644337516,-.830603856008,.176162036983,.546063583369,-.643095463524,-.536920557978
scale,1.00002,4.81258e-10,9.64116e-10
tolerance,1,.01,10,.00057,.00061,6.4e-5,.00055
tolerance,2,.01,10,5.7e-5,6.2e-5,7.3e-6,5.6e-5
tolerance,4,.01,10,2.4e-10,1.4e-10,1.1e-10,1.1e-10
single,3.4e-5
name,tiny_fast
inertia_B,4.48e-8,5.651e-11,2.137e-9,5.651e-11,4.274e-8,-8.16e-10,2.137e-9,-8.16e-10,5.324e-8
quaternion_wxyz0,-.024905367561,-.782168571581,-.416089674908,-.463099806448
w_WB_B0,215.5,128.8,-164.2
sample,.00033,-.00078849058,-.761066699215,-.453804148479,-.463506906585,216.6216023664,126.641690707,-164.3938800226
scale,299.986,.0020557,1.37463e-5
tolerance,1,.01,10,.00011,2e-4,1.8e-5,.00012
tolerance,2,.01,10,1.5e-5,2.1e-5,2.7e-6,1.3e-5
tolerance,4,.01,10,2.4e-10,1.4e-10,1.1e-10,1.2e-10
single,3.4e-5
name,walking_pace
inertia_B,.8099,-.00586,-.01041,-.00586,.8089,.00958,-.01041,.00958,.8239
quaternion_wxyz0,-.775127906658,-.185030532557,.286047201683,-.532087801732
w_WB_B0,.02244,.04795,.08484
sample,1,-.756401363967,-.168592678297,.268959227751,-.571921689762,.0224224698228,.0481121522205,.0847527934615
scale,.100003,.00411182,.0822474
tolerance,1,.01,10,.00051,5e-4,1.2e-5,.00051
tolerance,2,.01,10,5.2e-5,5.1e-5,2.1e-6,5.2e-5
tolerance,4,.01,10,2.4e-10,1.5e-10,1.1e-10,1.1e-10
single,3.3e-5
name,fast
inertia_B,.8812,-.0299,.109,-.0299,.9868,.1588,.109,.1588,1.207
quaternion_wxyz0,-.748155258326,.58612163286,.282058533219,-.131027190963
w_WB_B0,-326,908.1,-262.8
sample,1e-4,-.752123997076,.599878943248,.257661233843,-.089807767175,-330.0531090618,906.0350244243,-264.6289699644
scale,999.993,475678,952.836
tolerance,1,.01,10,.00017,.00021,1.3e-5,.00017
tolerance,2,.01,10,2e-5,2.2e-5,2.1e-6,1.8e-5
tolerance,4,.01,10,2.4e-10,1.3e-10,1.1e-10,1.3e-10
single,3.4e-5
name,half_turn_slow
inertia_B,.8868,.09572,.03171,.09572,1.127,.2494,.03171,.2494,1.132
quaternion_wxyz0,.054096488981,.264982801849,.646958010553,-.71295372724
w_WB_B0,.005301,.01296,-.01428
sample,5,.004123912615,.265435626072,.64790674323,-.713963426117,.00529663916983,.01300048427984,-.01424508416235
sample,10,-.045859203428,.265354494612,.647223701313,-.713151741293,.00528941417733,.0130418683854,-.01421027297955
sample,15,-.095727662301,.264741949711,.644910498133,-.710519784476,.00527932133719,.01308415605275,-.01417555321288
sample,20,-.145356520806,.263602261347,.640972580665,-.706073282675,.00526635597919,.01312735022887,-.01414091067625
scale,.0200007,.000180543,.0180695
tolerance,1,.01,10,.0022,.0021,8.6e-5,.0022
tolerance,2,.01,10,6e-5,5.5e-5,3.6e-6,5.6e-5
tolerance,4,.01,10,6.4e-10,1.8e-10,1.1e-10,1.6e-10
single,7.5e-5
name,torque_and_rotor
features,rotor,torque
inertia_B,.7859,-.2539,-.175,-.2539,.8081,.01264,-.175,.01264,1.181
quaternion_wxyz0,-.707928824874,.085291424805,-.209978888734,-.668932745538
w_WB_B0,-.3308,.6182,-.7131
rotor_momentum_B,-.102,.0889,.47
torque_B,.415,-.334,.578
sample,.1,-.722566984008,.123621717508,-.216671594833,-.644723230987,-.321777720106,.557187444228,-.663801945577
scale,1.00006,.502762,.830319
tolerance,1,.01,10,.0013,.00094,.00065,.0011
tolerance,2,.01,10,8.2e-5,5.5e-5,2e-5,8.2e-5
tolerance,4,.01,10,3.1e-10,2.4e-10,1.9e-10,3.1e-10
single,3.5e-5
name,damped
features,damping
inertia_B,.3919,0,0,0,.6702,0,0,0,.3418
quaternion_wxyz0,-.703884220568,-.509916125695,-.336944577175,.36194046569
w_WB_B0,.7249,-.6706,.1575
damping,.087,0,0,0,.0821,0,0,0,.0739
sample,.2,-.694208072664,-.53896732184,-.253645539906,.404046182908,.6725306120189,-.6563486944512,.2247339429246
sample,.4,-.683130717889,-.56136133328,-.167784848617,.435951970232,.6162510995068,-.6428799957858,.281943256633
sample,.6,-.671374170726,-.576391227855,-.080927296902,.458781699669,.5575043008933,-.6299750719911,.3295339541524
sample,.8,-.659420129594,-.583672711928,.005496016773,.473773207174,.4975540271041,-.6174486138359,.3680137969515
scale,.999995,.257903,.534413
tolerance,1,.01,20,.0058,.0072,.0021,.0037
tolerance,2,.01,20,.00011,.00011,2.8e-5,6.7e-5
tolerance,4,.01,20,1.7e-9,1.5e-9,2.5e-10,1.3e-9
single,.00014
name,orbit_flat
features,orbit
inertia_B,104.1,1.335,20.02,1.335,76.02,42.43,20.02,42.43,97.28
quaternion_wxyz0,-.720623572499,-.295845461109,-.611680480402,-.137927951463
w_WB_B0,-.001075,.0008884,.0005521
orbit,.00105
sample,148,-.694082227649,-.248358277242,-.631339741757,-.240786540042,-.001273515980661,.000938316138226,.000609189917618
sample,296,-.656902752666,-.188432003709,-.638726835542,-.353553649501,-.001489004095649,.000988056039612,.000679054139937
sample,444,-.605308317068,-.116451664536,-.628716422745,-.474084919488,-.00171701448256,.001033393421464,.000767229301881
sample,592,-.535115395503,-.034671454685,-.595876556406,-.597813125694,-.001938955150609,.001065491586751,.000877124747801
scale,.00237995,.000279105,.23499
tolerance,1,.01,40,.0054,.0057,.0013,.0035
tolerance,2,.01,40,8.1e-5,8.3e-5,9.5e-5,6.9e-5
tolerance,4,.01,40,7.8e-10,7.9e-10,9.3e-10,6.4e-10
single,.00031
mistake,inertia about the centre of mass,,.0014 .0046,,,,,,,,,,
mistake,sign of the torque,,,,,,,,,,.0086 .17,,
mistake,axes of the torque,,,,,,,,,,.0078 .16,,
mistake,without the torque,,,,,,,,,,.0043 .086,,
mistake,sign of the rotor,,,,,,,,,,.0078 .15,,
mistake,without the rotor,,,,,,,,,,.0039 .077,,
mistake,size of the rotor 0.98,,,,,,,,,,7.8e-5 .0015,,
mistake,sign of the damping,,,,,,,,,,,.12 .3,
mistake,without the damping,,,,,,,,,,,.055 .14,
mistake,turning of the field,,,,,,,,,,,,.024 .093
mistake,dead band 0.001,.0042 .0051,,,,,,,,,,,.7 .59
mistake,sign of the field,,.33 1,,,,,,,,,,.51 .74
mistake,without the field,,.16 .51,,,,,,,,,,.26 .39
mistake,smallest moments,,,,,3e-4 .0059,4e-4 .0081,,,,,,
mistake,rate limit 100,,,,,,.059 .67,,.081 .9,,,,
mistake,rate limit 47,,,.16 .22,,,.075 .84,,.086 .95,,,,
mistake,rate limit 7,.6 .3,,.69 .89,,,.087 .98,,.089 .99,,,,
mistake,dead band 0.01,.0042 .0051,.093 .27,,,,,,,.1 .26,,,1.1 1
mistake,attitude by normalisation,3e-5 0,.0022 0,.0017 0,,,4e-5 0,,,,4e-4 0,.0015 0,.0017 0
mistake,stale rates,2.4e-5 0,.0022 0,.0017 0,,,4e-5 0,,,,.00039 0,.0015 0,.0017 0
mistake,sign of the products of inertia,,,,.0016 .033,,.00026 .0053,.00017 .0033,.0013 .027,.017 .083,.0024 .047,,.54 .77
mistake,no products of inertia,,,,.00081 .016,,.00012 .0025,8.3e-5 .0017,6e-4 .012,.0066 .033,.001 .02,,.28 .41
mistake,diagonal gyroscopic term,,,,.00081 .016,,.00011 .0023,8.3e-5 .0017,.00058 .012,.0059 .03,.00091 .018,,.23 .4
mistake,damping 0.02,.004 .004,.0018 .0059,.00011 .00028,9.1e-5 .0018,1e-4 .002,3.3e-7 6.6e-6,.00099 .02,,.07 .33,9.7e-5 .0019,.0058 .014,1 1
mistake,inertia of the start,.003 .005,.0088 .043,.037 .14,2.2e-5 .00065,9.9e-6 3e-4,1.3e-5 4e-4,,8.2e-6 .00024,.00029 .0022,2.4e-5 .00071,.028 .098,.048 .11
mistake,damping 0.01,.002 .002,9e-4 .003,5.5e-5 .00014,4.6e-5 .00092,5e-5 .001,1.6e-7 3.3e-6,5e-4 .01,,.037 .18,4.9e-5 .00096,.0029 .0071,.94 .98
mistake,rates half a step late,0 2e-5,0 .0036,0 .0024,0 .00065,0 3e-4,0 .00041,,0 .00024,0 .00014,0 .0039,0 .0021,0 .0013
mistake,rates half a step early,0 2e-5,0 .0036,0 .0024,0 .00065,0 3e-4,0 .00041,,0 .00024,0 .00014,0 .0039,0 .0021,0 .0013
mistake,start in world rates,,.83 1.3,1.1 1.5,.16 1.6,.14 1.4,.17 1.7,.1 1,.13 1.3,.00027 .00068,.13 1.3,.99 1.3,1.5 1.4
mistake,inertia in world axes,,.073 .25,.21 .53,.0014 .028,3.6e-5 .00079,.00057 .012,.00018 .0036,.00088 .018,.0043 .022,.0033 .067,.16 .4,.31 .49
mistake,start transposed,,.32 .0059,2 0,1.6 0,.45 0,.1 0,2.7 0,2.9 0,.22 0,3.1 0,3.1 0,3.1 .63
mistake,rates in degrees,0 56,0 56,0 56,0 56,0 56,0 56,0 56,0 56,0 56,0 52,0 54,0 56
mistake,transposed,3.1 0,.27 0,2.7 0,1.5 0,.31 0,.0032 0,2.9 0,2.9 0,.58 0,3.1 0,3.1 0,3.1 0
mistake,start in order xyzw,3.1 0,2 .29,2 0,2.6 0,2.1 0,2 0,2.4 0,2.7 0,2.5 0,2 0,2.8 0,1.9 .16
mistake,start in order wxyz,3.1 0,2 .99,2 0,2.6 0,2.1 0,2 0,2.4 0,2.7 0,2.5 0,2 0,2.8 0,1.9 .4
mistake,order xyzw,2.7 0,2.4 0,1.8 0,2.6 0,2 0,2 0,2.4 0,2.6 0,2.7 0,2.1 0,3 0,1.7 0
mistake,axes y up,2.5 1.4,3.1 1.4,1.1 1.3,2.6 .25,2.6 1.2,1.9 .98,1.9 1.4,.78 1.3,3 1.4,2 1.2,1.4 1,2.6 .82
mistake,reversed rates,0 2,0 2,0 2,0 2,0 2,0 2,0 2,0 2,0 2,0 1.8,0 1.9,0 2
mistake,start in degrees,2 .98,.43 .69,.78 .98,.098 .98,.098 .98,.097 .98,.098 .98,.098 .98,.39 .98,.098 .98,.73 .95,.97 .82
mistake,factor one half,2 0,.54 .065,.79 0,.099 0,.1 0,.099 0,.1 0,.1 0,.4 0,.096 0,.75 0,1 .2
mistake,sleep,2 1,.52 1,.79 1,.099 1,.1 1,.099 1,.1 1,.1 1,.4 1,.096 .92,.75 .97,1.1 1
mistake,frozen motion,2 .0051,.52 .53,.79 .35,.099 .013,.1 .0059,.099 .0081,.1 .0018,.1 .0049,.4 .011,.096 .079,.75 .31,1.1 .39
mistake,world y up,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0
mistake,world turned the wrong way,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0
mistake,start in a world with y up,1.6 0,1.6 .44,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 .18
mistake,damping 0.2,.039 .039,.018 .057,.0011 .0028,.00091 .018,.00099 .02,3.3e-6 6.6e-5,.0094 .18,1e-6 2e-5,.3 .98,.00097 .019,.056 .13,1.1 1
mistake,damping 0.1,.02 .02,.0089 .029,.00055 .0014,.00046 .0092,5e-4 .01,1.6e-6 3.3e-5,.0048 .095,5e-7 1e-5,.23 .86,.00049 .0096,.029 .068,1.1 1
mistake,R I for R I R',.0082 .02,.28 .89,.6 1.2,.0052 .1,.0051 .1,.0048 .098,.0045 .09,.0078 .16,.0044 .022,.0051 .1,.23 .52,1.1 1.4
mistake,damping 0.05,.01 .01,.0045 .015,.00028 7e-4,.00023 .0046,.00025 .005,8.2e-7 1.6e-5,.0025 .049,2.5e-7 5e-6,.15 .63,.00024 .0048,.014 .035,1.1 1
mistake,no gyroscopic term + damping 0.05,.011 .011,.014 .057,.14 .35,.00069 .014,.00039 .0078,4e-4 .0081,.0025 .049,.00025 .0049,.15 .63,.0031 .062,.11 .26,1.1 1
mistake,inverted inertia,.016 .019,2.7 36,.29 .72,.0017 .035,.00057 .011,.00072 .015,.00018 .0036,6e-4 .012,.0073 .037,.001 .019,.17 .42,1.1 65
mistake,a step late,.01 3.9e-5,.0082 .0072,.01 .0047,.0099 .0013,.01 .00059,.0099 .00081,.01 .00018,.01 .00048,.01 .00029,.0093 .0079,.0097 .0042,.0088 .0027
mistake,a step early,.01 3.9e-5,.0083 .0072,.01 .0047,.0099 .0013,.01 .00059,.0099 .00081,.01 .00018,.01 .00048,.01 .00029,.0092 .0079,.0097 .0042,.0088 .0027
mistake,sign of the gyroscopic term,.0074 .0089,.026 .1,.26 .64,.0013 .026,.00059 .012,.00081 .016,.00018 .0037,5e-4 .0099,.0042 .021,.0062 .12,.22 .5,.24 .4
mistake,world rates,0 .0054,0 2,0 1.5,0 1.6,0 1.4,0 1.7,0 1,0 1.3,0 .022,0 1.2,0 1.4,0 1.4
mistake,no gyroscopic term,.0042 .0051,.014 .056,.14 .35,.00065 .013,3e-4 .0059,4e-4 .0081,9.2e-5 .0018,.00025 .0049,.0022 .011,.0031 .062,.11 .26,.11 .18
mistake,half a step late,.005 2e-5,.0041 .0036,.0051 .0024,.005 .00065,.005 3e-4,.0049 .00041,.005 9.2e-5,.005 .00024,.005 .00014,.0046 .0039,.0048 .0021,.0044 .0013
mistake,half a step early,.005 2e-5,.0041 .0036,.0051 .0024,.005 .00065,.005 3e-4,.0049 .00041,.005 9.2e-5,.005 .00024,.005 .00014,.0046 .0039,.0048 .0021,.0044 .0013
mistake,wrong side,.003 0,.99 .21,1.1 0,.16 0,.14 0,.17 0,.1 0,.13 0,.0044 0,.12 0,1.1 0,1.5 .31
";
// END MOTIONS

#[test]
fn exact_rotations() {
    assert_eq!(run(&[]), Ok(true), "the reasons are above");
}

#[cfg(not(test))]
fn main() {
    match run(&std::env::args().skip(1).collect::<Vec<_>>()) {
        Ok(right) => std::process::exit(i32::from(!right)),
        Err(why) => {
            println!("{why}");
            std::process::exit(2);
        }
    }
}
