/* The program that runs an engine in JavaScript: what program.py is for Python. It speaks the protocol of PROTOCOL.md in binary
 * framing, for one body per run. `node program.mjs FOLDER`: packages are in FOLDER/node_modules. An adapter is a module with
 *
 *   ENGINE                      its data, see read_script in environments/adapter.py
 *   start(package, url)         returns the engine; by default the package
 *   build(given, engine, own)   returns a world for one call of a run, with `step()`, and `read()` for an attitude and rates.
 *                               Rates are in world axes, or in F if `rates` is "w". The attitude is of axes that are turned by
 *                               `axes` relative to F. The engine destroys what is passed to `own`, the last one first
 *
 * `given` has the numbers of a run, the settings, and `central`, the start of axes that are principal at the centre of mass:
 * attitude `q`, `position` and `velocity` in the world, and the fixed `point` in these axes.
 */
import { readSync, writeSync } from 'fs';
import { pathToFileURL } from 'url';
import { Worker } from 'worker_threads';

const WARM_UP = 20; // ms in unmeasured calls before a run is measured
const NAMED = { nan: NaN, inf: Infinity, '-inf': -Infinity };
const { find } = await import(pathToFileURL(`${process.argv[2]}/find.mjs`));

function read(count) {
  const data = Buffer.from(new ArrayBuffer(count));
  for (let done = 0, part; done < count; done += part) {
    part = readSync(0, data, done, count - done);
    if (part === 0) process.kill(process.pid, 'SIGKILL'); // the client is gone
  }
  return data;
}

function receive() {
  const prefix = read(16), text = read(prefix.readUInt32LE(4)), { buffer } = read(Number(prefix.readBigUInt64LE(8)));
  const { arrays, ...message } = JSON.parse(text, (_, value) => NAMED[value] ?? value);
  let start = 0;
  for (const [name, kind, shape] of arrays) {
    const count = shape.reduce((a, b) => a * b);
    message[name] = Array.from(new (kind === '<i8' ? BigInt64Array : Float64Array)(buffer, start, count), Number);
    start += 8 * count;
  }
  return message;
}

/** Send values, and arrays (n, m) as name, m and a Float64Array. */
function send(values, arrays = []) {
  const prefix = Buffer.alloc(16, 'cv01'), data = Buffer.concat(arrays.map(([, , array]) => Buffer.from(array.buffer)));
  const kinds = arrays.map(([name, m, { length }]) => [name, '<f8', [length / m, m]]);
  const text = Buffer.from(JSON.stringify({ ...values, arrays: kinds }));
  prefix.writeUInt32LE(text.length, 4);
  prefix.writeBigUInt64LE(BigInt(data.length), 8);
  writeSync(1, Buffer.concat([prefix, text, data]));
}

const product = ([a, b, c, d], [s, x, y, z]) => [
  a * s - b * x - c * y - d * z, a * x + b * s + c * z - d * y, a * y - b * z + c * s + d * x, a * z + b * y - c * x + d * s,
];
const conjugate = ([s, x, y, z]) => [s, -x, -y, -z];
const rotate = (q, v) => product(product(q, [0, ...v]), conjugate(q)).slice(1);

function central({ q0, w0_W: [x, y, z], com, q_com }) {
  const position = rotate(q0, com), [a, b, c] = position, velocity = [y * c - z * b, z * a - x * c, x * b - y * a];
  return { q: product(q0, q_com), position, velocity, point: rotate(conjugate(q_com), com.map((value) => -value)) };
}

const list = (v) => (v[Symbol.iterator] ? v : 'w' in v ? [v.w, v.x, v.y, v.z] : [v.x, v.y, v.z]);

function free({ owned }) {
  for (const each of owned.splice(0).reverse()) typeof each === 'function' ? each() : engine.destroy(each);
}

/** Return the time of a call of a run in ms, and its samples. */
function call(run) {
  free(run); // no collector reaches the memory of WebAssembly
  const { given, build, owned } = run, n = given.steps.length, q = new Float64Array(4 * n), w = new Float64Array(3 * n);
  const world = build(given, engine, (object) => (owned.push(object), object));
  const { step, read, axes = [1, 0, 0, 0], rates = 'w_W' } = world, back = conjugate(axes), start = performance.now();
  for (let i = 0, done = 0; i < n; i++) {
    for (; done < given.steps[i]; done++) step();
    const [attitude, values] = read().map(list);
    q.set(product(attitude, back), 4 * i);
    w.set(values, 3 * i);
  }
  const time = performance.now() - start;
  run.spent += time;
  q.set(given.q0); // in double precision
  w.set(given[rates.replace('w', 'w0')]);
  return [time, [['q', 4, q], [rates, 3, w]]];
}

async function load(name) {
  const url = find(name), loaded = await import(url);
  return [loaded.default ?? loaded, url];
}

const runs = new Map();
let engine, count = 0;
const operations = {
  check: async ({ module }) => [void (await load(module))],
  prepare: async ({ adapter, settings, ...numbers }) => {
    if (numbers.rows) return [{ error: 'unsupported', message: 'many bodies in one run' }];
    const { ENGINE, start = (module) => module, build } = await import(pathToFileURL(adapter));
    engine ??= await start(...(await load(ENGINE.package)));
    runs.set(++count, { given: { ...numbers, ...settings, central: central(numbers) }, build, owned: [], spent: 0 });
    return [{ run: count }];
  },
  run: ({ run }) => [{}, call(runs.get(run))[1]],
  time: ({ run, calls }) => {
    const measured = runs.get(run);
    while (measured.spent < WARM_UP) call(measured);
    let total = 0;
    for (let i = 0; i < calls; i++) total += call(measured)[0];
    return [{ seconds: total / 1000 }];
  },
};

Object.defineProperty(process, 'stdout', { value: process.stderr }); // engines print
let hello = '';
while (!hello.endsWith('\n')) hello += read(1);
// The end of the client also ends a loop of an engine: another thread waits for it.
const socket = `new (require('net').Socket)({ fd: ${JSON.parse(hello).life} })`;
new Worker(`${socket}.on('close', () => process.kill(process.pid, 'SIGKILL')).resume()`, { eval: true }).unref();
writeSync(1, Buffer.from(`{"protocol": 1, "program": "node", "version": "${process.versions.node}", "framing": "binary"}\n`));
for (;;) {
  const { do: name, forget, ...values } = receive();
  try {
    for (const run of forget) if (runs.has(run)) free(runs.get(run)), runs.delete(run);
    send(...(await operations[name](values)));
  } catch (error) {
    send({ error: error?.name ?? 'Error', message: String(error?.message ?? error).replace(/\s+/g, ' ').slice(0, 2000) });
  }
}
