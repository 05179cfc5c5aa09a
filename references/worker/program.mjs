/* The program that runs an engine in JavaScript: what program.py is for Python. It speaks the protocol of PROTOCOL.md in lines,
 * for one body per run. `node program.mjs FOLDER`: packages are in FOLDER/node_modules. An adapter is a module with
 *
 *   ENGINE                      its data, see read_script in environments/adapter.py
 *   start(package, url)         returns the engine; by default the package
 *   load(path, engine, own)     optional: loads a model file for `load`, and returns a function from a velocity and a force to an
 *                               acceleration. `ENGINE` then has `formats`, and `own` is as in build
 *   build(given, engine, own)   returns a world for one call of a run, with `step()`, and `read()` for an attitude and rates.
 *                               Rates are in world axes, or in F if `rates` is "w". The attitude is of axes that are turned by
 *                               `axes` relative to F. The engine destroys what is passed to `own`, the last one first
 *
 * `given` has the numbers of a run, the settings, and those of P, axes that are principal at the centre of mass: their
 * initial attitude `q_P`, and the fixed point `point_P` in them.
 */
import { readSync, writeSync } from 'fs';
import { pathToFileURL } from 'url';
import { Worker } from 'worker_threads';

const WARM_UP = 20; // ms in unmeasured calls before a run is measured
const part = Buffer.alloc(1 << 16); // once: for each request it takes as long as the rest of the exchange
const { find } = await import(pathToFileURL(`${process.argv[2]}/find.mjs`));

function receive() { // 60 us faster than by events
  let line = '';
  while (!line.endsWith('\n')) {
    const count = readSync(0, part);
    if (count === 0) process.kill(process.pid, 'SIGKILL'); // the client is gone
    line += part.latin1Slice(0, count);
  }
  return JSON.parse(line);
}

const product = ([a, b, c, d], [s, x, y, z]) => [
  a * s - b * x - c * y - d * z, a * x + b * s + c * z - d * y, a * y - b * z + c * s + d * x, a * z + b * y - c * x + d * s,
];
const conjugate = ([s, x, y, z]) => [s, -x, -y, -z];
const list = (v) => (v[Symbol.iterator] ? [...v] : 'w' in v ? [v.w, v.x, v.y, v.z] : [v.x, v.y, v.z]);

function free({ owned }) {
  for (const each of owned.splice(0).reverse()) typeof each === 'function' ? each() : engine.destroy(each);
}

/** Return the time of a call of a run in ms, and its samples. */
function call(run) {
  free(run); // no collector reaches the memory of WebAssembly
  const { given, build, owned } = run, samples = [];
  const world = build(given, engine, (object) => (owned.push(object), object));
  const { step, read, axes = [1, 0, 0, 0], rates = 'w_W' } = world, start = performance.now();
  for (let i = 0, done = 0; i < given.steps.length; i++) {
    for (; done < given.steps[i]; done++) step();
    samples.push(read().map(list));
  }
  const time = performance.now() - start;
  run.spent += time;
  const q = samples.map(([attitude]) => product(attitude, conjugate(axes))), w = samples.map(([, values]) => values);
  [q[0], w[0]] = [given.q0, given[rates.replace('w', 'w0')]]; // in double precision
  return [time, { q, [rates]: w }];
}

async function load(name) {
  const url = find(name), loaded = await import(url);
  return [loaded.default ?? loaded, url];
}

/** Return the module of an adapter, whose engine is started. */
async function startEngine(adapter) {
  const module = await import(pathToFileURL(adapter)), { ENGINE, start = (loaded) => loaded } = module;
  engine ??= await start(...(await load(ENGINE.package)));
  return module;
}

const runs = new Map();
let engine, count = 0;
const operations = {
  hello: ({ life }) => {
    // The end of the client also ends a loop of an engine: another thread waits for it, or looks for it every second.
    const end = `() => process.kill(process.pid, 'SIGKILL')`;
    const wait = `new (require('net').Socket)({ fd: ${life} }).on('close', ${end}).resume()`;
    const look = `setInterval(() => { try { process.kill(${process.ppid}, 0) } catch { (${end})() } }, 1000)`;
    new Worker(life === undefined ? look : wait, { eval: true }).unref();
    return { protocol: 1, program: 'node', version: process.versions.node, framing: 'lines' };
  },
  check: async ({ module }) => void (await load(module)),
  load: async ({ adapter, path, velocities, forces }) => {
    const module = await startEngine(adapter), owned = [];
    try {
      const accelerate = module.load(path, engine, (object) => (owned.push(object), object));
      return { accelerations: velocities.map((velocity, i) => accelerate(velocity, forces[i])) };
    } finally {
      free({ owned });
    }
  },
  prepare: async ({ adapter, settings, ...given }) => {
    if (given.rows) return { error: 'unsupported', message: 'many bodies in one run' };
    const { build } = await startEngine(adapter);
    const { q0, q_com, com } = given, [, ...opposite] = product(product(conjugate(q_com), [0, ...com]), q_com);
    Object.assign(given, settings, { q_P: product(q0, q_com), point_P: opposite.map((value) => -value) });
    runs.set(++count, { given, build, owned: [], spent: 0 });
    return { run: count };
  },
  run: ({ run }) => call(runs.get(run))[1],
  time: ({ run, calls }) => {
    const measured = runs.get(run);
    while (measured.spent < WARM_UP) call(measured);
    let total = 0;
    for (let i = 0; i < calls; i++) total += call(measured)[0];
    return { seconds: total / 1000 };
  },
};

Object.defineProperty(process, 'stdout', { value: process.stderr }); // engines print
for (;;) {
  const { do: name, forget = [], ...values } = receive();
  let answer;
  try {
    for (const run of forget) if (runs.has(run)) free(runs.get(run)), runs.delete(run);
    answer = await operations[name](values);
  } catch (error) {
    answer = { error: error?.name ?? 'Error', message: String(error?.message ?? error).replace(/\s+/g, ' ').slice(0, 2000) };
  }
  writeSync(1, `${JSON.stringify(answer ?? {})}\n`);
}
