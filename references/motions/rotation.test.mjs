// Exact rotations as a test of your engine (CC0). Fill in `simulate`, then run   node --test   or   node rotation.test.mjs
// With node rotation.test.mjs --record known.txt, today's errors become known errors: a later run fails only if a motion gets worse.
import { existsSync, readdirSync, readFileSync, realpathSync, statSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
const ORDER = 2; // the order of your integrator: 1, 2 or 4 (2 for order 3)
const ANGLE = 0.01; // |w| h in rad; 0.03 and 0.1 with the files of all motions
const SINGLE = false; // single precision
const HAS = ""; // what `simulate` reads of `m`: "rotor, torque, damping, fixed point, orbit"; other motions are skipped

// YOUR ENGINE: set up the body of the motion `m`, and return [quaternion, rates] after each `steps` steps of h seconds:
// the quaternion has the scalar first and maps body to world, the rates are in body axes, rad/s.
function simulate(m, h, steps, samples) {
  const states = []; // m.inertia_B is the inertia, 3 rows
  for (let i = 0; i < samples; i++) {
    for (let n = 0; n < steps; n++); // one step
    states.push([m.quaternion_wxyz0, m.w_WB_B0]);
  }
  return states;
}
// END

const NAMES = ["attitude", "rates", "energy", "momentum"];
const NEAR = 0.2; // mean square of logarithms: errors over the errors of a mistake that explains them
const LARGE = 0.08; // errors that show two mistakes
const LARGEST = 1e6; // instead of errors that are not finite
const FEATURES = ["rotor", "torque", "damping", "fixed point", "orbit"];
const HEADER = "# Known errors on exact motions. A later run fails if a motion is worse or has another mistake. Written by --record.";
class Refused extends Error {}

function read(text) { // the motions of lines with a key and its values
  const motions = [];
  for (const [key, ...values] of text.split("\n").map((line) => line.trim().split(","))) {
    const m = motions.at(-1), row = values.map(Number);
    if (key === "name") motions.push({ name: values[0], features: [], samples: [], tolerance: [], catches: {} });
    else if (key === "mistake") // a field for each motion
      motions.forEach((m, i) => { if (values[i + 1]) m.catches[values[0]] = values[i + 1].split(" ").map(Number); });
    else if (!m || key === "about") continue;
    else if (key === "catches") m.catches[values[0]] = row.slice(1);
    else if (key === "features") m.features = values.filter(Boolean);
    else if (key === "sample") { // files have a matrix before the quaternion, and more after the rates
      const q = row.length > 8 ? 10 : 1;
      m.samples.push([row[0], row.slice(q, q + 4), row.slice(q + 4, q + 7)]);
    } else if (key === "tolerance") m.tolerance.push(row);
    else if (key === "inertia_B" || key === "damping") m[key] = [row.slice(0, 3), row.slice(3, 6), row.slice(6)];
    else m[key] = row.length === 1 ? row[0] : row;
  }
  return motions;
}

const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const apart = (a, b, sign = 1) => Math.hypot(...a.map((x, i) => x - sign * b[i]));
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
function rotate([s, ...u], v) {
  const uv = cross(u, v), uuv = cross(u, uv);
  return v.map((x, i) => x + 2 * (s * uv[i] + uuv[i]));
}
function invariants(m, q, w) { // the energy, and the momentum in world axes
  const L = m.inertia_B.map((row) => dot(row, w));
  const energy = dot(L, w) / 2 + (m.weight ?? 0) * rotate(q, m.com_B ?? [0, 0, 0])[2];
  return [energy, rotate(q, L.map((x, k) => x + (m.rotor_momentum_B ?? [0, 0, 0])[k]))];
}

function worst(m, steps) { // the largest errors of attitude (rad), rates, energy and momentum, with so many steps before each sample
  const states = simulate(m, m.samples[0][0] / steps, steps, m.samples.length) ?? [];
  if (states.length !== m.samples.length)
    throw new Refused(`${m.name}: simulate returned ${states.length} states, expected ${m.samples.length}`);
  if (!states.every((y) => y?.[0]?.length === 4 && y[1]?.length === 3))
    throw new Refused(`${m.name}: simulate returned another state, expected a quaternion (4) and rates (3)`);
  const found = [0, 0, 0, 0];
  states.map(([q, w]) => [[...q].map(Number), [...w].map(Number)]).forEach(([q, w], i) => {
    const [, q0, w0] = m.samples[i], [E, L] = invariants(m, q, w), [E0, L0] = invariants(m, q0, w0);
    const angle = 4 * Math.asin(Math.min(1, apart(q, q0) / 2, apart(q, q0, -1) / 2));
    [angle, apart(w, w0) / m.scale[0], Math.abs(E - E0) / m.scale[1], apart(L, L0) / m.scale[2]].forEach((e, k) => {
      found[k] = e < LARGEST ? Math.max(found[k], e) : LARGEST;
    });
  });
  return found;
}

function check(m) { // run a motion: its errors, the mistakes that explain them, and the order if the body is free
  const row = m.tolerance.find((each) => each[0] === ORDER && each[1] === ANGLE);
  if (!row) throw new Refused(`${m.name} has no tolerance for order ${ORDER} and |w| h = ${ANGLE} rad`);
  const limit = row.slice(3).map((x) => x + (SINGLE ? m.single : 0)), found = worst(m, row[2]), free = !m.features.length;
  const most = found.reduce((most, x, k) => (x / limit[k] > found[most] / limit[most] ? k : most), 0), ratio = found[most] / limit[most];
  const near = new Map();
  let order = null, falls = 0, note = "";
  if (free || ratio > 1) {
    const half = worst(m, 2 * row[2]);
    if (free && found[0] < LARGEST && half[0] > (SINGLE ? m.single : 1e-11)) order = Math.max(0, Math.log2(found[0] / half[0])); // above rounding
    if (found[most] < LARGEST && half[most] > 0) falls = Math.log2(found[most] / half[most]);
  }
  if (ratio > 1) {
    for (const [name, known] of Object.entries(m.catches)) {
      const squares = known.map((x, k) => Math.log(Math.max(found[k], limit[k]) / Math.max(x, limit[k])) ** 2);
      const distance = squares.reduce((a, b) => a + b) / known.length;
      if (distance < NEAR) near.set(name, distance);
    }
    if (falls >= ORDER - 0.5 && (ratio <= 2 || !near.size))
      note = `: ${(100 * (ratio - 1)).toFixed(0)} % above the tolerance, falls as h^${falls.toFixed(1)}: right`;
    if (!near.size && !note) // a large error of the attitude alone, or of the rates alone, is still there beside another mistake
      for (const [name, known] of Object.entries(m.catches)) {
        const k = Number(known[0] < known[1]);
        if (!known[1 - k] && known[k] > LARGE && Math.abs(Math.log(Math.max(found[k], limit[k]) / known[k])) < 0.03) near.set(name, NEAR);
      }
  }
  return { name: m.name, free, found, limit, most, near, order, note, failed: ratio > 1 && !note, mistake: "" };
}

// Name the mistake of each motion that fails, those that explain most motions first, and return lines about them.
function summary(failing, whole, order) {
  let rest = failing;
  const lines = [];
  for (const each of failing) each.mistake = [...each.near].sort((a, b) => a[1] - b[1])[0]?.[0] ?? "";
  for (let n = 0; n < 3; n++) {
    const votes = new Map();
    for (const { near } of rest) for (const [name, distance] of near) votes.set(name, [...(votes.get(name) ?? []), distance]);
    const sum = ([, distances]) => distances.reduce((a, b) => a + b);
    const best = [...votes].sort((a, b) => b[1].length - a[1].length || sum(a) - sum(b))[0];
    if (!best || 10 * best[1].length < failing.length) break;
    lines.push(`"${best[0]}" explains ${best[1].length} of ${whole}`);
    for (const each of rest) if (each.near.has(best[0])) each.mistake = best[0];
    rest = rest.filter((each) => !each.near.has(best[0]));
  }
  if (2 * rest.length > failing.length && order !== null && order >= 0.5 && order < ORDER - 0.5)
    lines.push(`this program has order ${order.toFixed(1)}, ${ORDER} was declared`);
  if (rest.length) {
    lines.push(`${rest.length} not explained by a mistake: ${rest.slice(0, 5).map((r) => r.name).join(", ")}`);
    lines.push("What now: references/motions/my_engine_fails.md of conservative-rotation");
  }
  return lines;
}

const scientific = (x, digits) => x.toExponential(digits - 1).replace(/e(.)(\d)$/, "e$10$2"); // 1.2e-05
const short = (x, digits) => (x >= 0.01 && x < 10 ? x.toFixed(digits - 1 - Math.floor(Math.log10(x))) : scientific(x, digits));
// An error in two digits of the three that are recorded, so that the same number looks the same.
const two = (x, k = 1) => (x < LARGEST ? scientific(Number(scientific(x, 3)), 2) + (k ? "" : " rad") : "not finite");
const error = (r, k) => `${r.name}: ${NAMES[k]} error ${two(r.found[k], k)}`;
const settings = (order = ORDER, angle = ANGLE, precision = SINGLE ? "single" : "double") => `order ${order}, ${angle} rad, ${precision}`;
const orNone = (mistake) => mistake || "no known mistake";

function readKnown(path) { // the order and, by motion, the errors and the mistake, of a file of known errors
  let text, order = null, then = null;
  try { text = readFileSync(path, "utf8"); } catch { throw new Refused(`${path}: cannot be read. Write it with --record ${path}`); }
  const known = new Map();
  text.split("\n").map((line) => line.trim()).forEach((line, n) => {
    const [key, ...values] = line.split(","), isNumber = (x) => Boolean(x) && Number.isFinite(Number(x));
    if (key === "settings" && values.length === 3) then = settings(Number(values[0]), Number(values[1]), values[2]);
    else if (key === "order" && isNumber(values[0])) order = Number(values[0]);
    else if (key === "motions" && values.length === 4 && isNumber(values[1]) && isNumber(values[2]))
      known.set(values[0], { error: [Number(values[1]), Number(values[2])], mistake: values[3] });
    else if (line && !line.startsWith("#")) throw new Refused(`${path}: line ${n + 1} is not of this test: ${line}. Record again: --record ${path}`);
  });
  if (!then) throw new Refused(`${path}: not a file of known errors. Write another one with --record`);
  if (then !== settings()) throw new Refused(`${path}: recorded with ${then}; now ${settings()}: record again`);
  return [order, known];
}

function writeKnown(path, results, order) {
  let old = HEADER;
  try { if (existsSync(path)) old = readFileSync(path, "utf8"); } catch { old = ""; }
  if (!old.startsWith(HEADER.slice(0, 31))) throw new Refused(`${path}: not a file of known errors, and not replaced. Choose another name`);
  const lines = [HEADER, `settings,${ORDER},${ANGLE},${SINGLE ? "single" : "double"}`, ...(order === null ? [] : [`order,${order.toFixed(2)}`])];
  for (const r of results) lines.push(`motions,${r.name},${short(r.found[0], 3)},${short(r.found[1], 3)},${r.mistake}`);
  try { writeFileSync(path, lines.join("\n") + "\n"); } catch { throw new Refused(`${path}: cannot be written`); }
}

function compare(results, order, path, skipped) { // the lines of a run with known errors, and the number of motions that are worse
  const [before, known] = readKnown(path), lines = [], mistakes = new Map();
  for (const r of results) {
    const was = r.was = known.get(r.name), margin = (k) => 0.01 * was.error[k] + r.limit[k]; // recorded numbers have three digits
    r.worse = [0, 1].filter((k) => was && r.found[k] > was.error[k] + margin(k));
    r.lower = [0, 1].filter((k) => was && !r.worse.length && r.found[k] < was.error[k] - margin(k));
    r.same = was && (was.mistake ? r.near.has(was.mistake) : !r.near.size);
    r.isNew = r.failed && (!was || r.worse.length || !(r.same || r.lower.length));
  }
  const failing = results.filter((r) => r.isNew), about = summary(failing, `${failing.length} new failures`, order);
  for (const r of results) {
    const { was, same } = r, mistake = orNone(r.mistake), k = Number(r.worse[0] === 1);
    if (r.isNew && was) lines.push(`${error(r, k)}, was ${two(was.error[k])}; ${mistake}${same ? "" : `, was ${orNone(was.mistake)}`}`);
    else if (r.isNew) lines.push(`${error(r, r.most)}, tolerance ${two(r.limit[r.most])}, not recorded; ${mistake}`);
    else if (r.failed) {
      const counted = same ? orNone(was.mistake) : mistake;
      mistakes.set(counted, (mistakes.get(counted) ?? 0) + 1);
    }
    const by = r.lower.find((k) => two(was.error[k]) !== two(r.found[k]));
    if (by === undefined) continue;
    const other = (by ? " (rates)" : "") + (r.failed && !same ? `, now ${mistake}` : "");
    lines.push(`better: ${r.name}, ${two(was.error[by])} to ${two(r.found[by], by)}${other}: record again to tighten`);
  }
  const gone = [...known.keys()].filter((name) => results.every((r) => r.name !== name)), worse = failing.length + gone.length;
  for (const name of gone) lines.push(`${name}: was tested, is ${skipped.includes(name) ? "skipped" : "not there"} now: record again`);
  const counts = [...mistakes].sort((a, b) => b[1] - a[1]), sum = counts.reduce((a, b) => a + b[1], 0);
  const each = counts.map(([name, n]) => `${name}: ${n}`).join(", ");
  lines.push(...about, `known errors of ${path}: ${sum}${each && ` (${each})`}, new failures: ${worse}`);
  const free = results.filter((r) => r.free && r.was), parts = [];
  const a = Math.max(0, ...free.map((r) => r.was.error[0])), b = Math.max(0, ...free.map((r) => r.found[0]));
  if (short(a, 2) !== short(b, 2) && Math.abs(b - a) > 0.01 * a && Math.max(a, b) < LARGEST && (b > a || !worse))
    parts.push(`attitude error ${short(a, 2)} to ${short(b, 2)} rad`);
  if (before !== null && order !== null && Math.abs(before - order) >= 0.2) parts.push(`order ${before.toFixed(1)} to ${order.toFixed(1)}`);
  const [first] = failing, text = [parts.join(", "), first && `first bad motion: ${first.name} (${orNone(first.mistake)})`].filter(Boolean).join("; ");
  if (text) lines.push(`free rotation at your step: ${text}`);
  return [lines, worse];
}

// The file of known errors that is used without being asked for: in the current folder, or beside the test.
const usualFile = () => ["known.txt", fileURLToPath(new URL("known.txt", import.meta.url))].find((path) => existsSync(path));

function run(values, say) { // test the motions and return the exit code: 0, or 1 if a motion fails
  const asked = { "--record": process.env.ROTATION_RECORD, "--known": process.env.ROTATION_KNOWN }, paths = [];
  while (values.length) {
    const each = values.shift();
    if (each in asked) {
      asked[each] = values.shift();
      if (!asked[each]) throw new Refused(`${each}: expected the name of a file`);
    } else if (each.startsWith("-") || !existsSync(each)) {
      throw new Refused(`${each}: expected --record FILE, --known FILE, a folder of motions or CSV files`);
    } else if (statSync(each).isDirectory()) {
      paths.push(...readdirSync(each).filter((name) => name.endsWith(".csv")).sort().map((name) => `${each}/${name}`));
    } else paths.push(each);
  }
  const record = asked["--record"], has = HAS.split(",").map((part) => part.trim());
  for (const part of has) if (part && !FEATURES.includes(part)) throw new Refused(`HAS: got ${part}; allowed: ${FEATURES.join(", ")}`);
  if (record && asked["--known"]) throw new Refused("record and known are both given: give one of them");
  const known = asked["--known"] || (!record && usualFile());
  const motions = (paths.length ? paths.map((path) => readFileSync(path, "utf8")) : [MOTIONS]).flatMap((text, i) => {
    const some = read(text);
    if (!some.length) throw new Refused(`${paths[i]}: a file without a motion`);
    return some;
  });
  const results = [], skipped = [];
  for (const m of motions) {
    const part = m.features.find((each) => !has.includes(each));
    if (!part) { results.push(check(m)); continue; }
    say(`${m.name}: skipped, it has ${part}`);
    skipped.push(m.name);
  }
  const orders = results.map((r) => r.order).filter((x) => x !== null).sort((a, b) => a - b), order = orders[orders.length >> 1] ?? null;
  const failing = results.filter((r) => r.failed), about = summary(failing, "them", order);
  for (const r of results) {
    if (!r.note && (known || !r.failed)) continue;
    say(`${error(r, r.most)}, tolerance ${two(r.limit[r.most])}${r.note || `; ${orNone(r.mistake)}`}`);
  }
  if (known) {
    const [lines, worse] = compare(results, order, known, skipped);
    lines.forEach(say);
    return Number(worse > 0);
  }
  say(`${failing.length} of ${results.length} motions failed`);
  about.forEach(say);
  if (record) {
    writeKnown(record, results, order);
    const used = usualFile(), hint = used && realpathSync(used) === realpathSync(record) ? "" : `. The next run needs --known ${record} (or ROTATION_KNOWN)`;
    say(`${record}: ${results.length} motions recorded, ${failing.length} known errors${hint}`);
    return 0;
  }
  if (failing.length) say("Known and accepted? --record known.txt (or ROTATION_RECORD=known.txt): then only new failures fail");
  return Number(failing.length > 0);
}

// BEGIN MOTIONS
const MOTIONS = `
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
`;
// END MOTIONS

try {
  process.exitCode = run(process.argv.slice(2), (line) => console.log(line));
} catch (e) {
  if (!(e instanceof Refused)) throw e;
  console.log(e.message);
  process.exitCode = 2;
}
