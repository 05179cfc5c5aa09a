/* The program that runs an engine in JavaScript: what program.py is for Python. It speaks the protocol of PROTOCOL.md in binary
 * framing, for one body per run, and uses no package.
 *
 *   node program.mjs FOLDER      packages are in FOLDER/node_modules
 *
 * An adapter is a module with `ENGINE`, `start(module)`, which returns what the engine is used through, and `prepare(given,
 * engine)`, which returns a run as in Python; see engines/shared.mjs.
 */
import { readSync, writeSync } from 'fs';
import { createRequire } from 'module';
import { pathToFileURL } from 'url';
import { Worker } from 'worker_threads';

const WARM_UP = 20; // ms in unmeasured calls before a run is measured
const NAMED = { nan: NaN, inf: Infinity, '-inf': -Infinity };

function read(count) {
  const data = Buffer.from(new ArrayBuffer(count));
  for (let done = 0, part; done < count; done += part) {
    part = readSync(0, data, done, count - done);
    if (part === 0) process.kill(process.pid, 'SIGKILL'); // the client is gone
  }
  return data;
}

function write(data) {
  for (let done = 0; done < data.length; ) done += writeSync(1, data, done);
}

function receive() {
  const prefix = read(16);
  const text = read(prefix.readUInt32LE(4)).toString(), { buffer } = read(Number(prefix.readBigUInt64LE(8)));
  const { arrays, ...message } = JSON.parse(text, (_, value) => NAMED[value] ?? value);
  let start = 0;
  for (const [name, kind, shape] of arrays) {
    const count = shape.reduce((a, b) => a * b);
    message[name] = Array.from(new (kind === '<i8' ? BigInt64Array : Float64Array)(buffer, start, count), Number);
    start += 8 * count;
  }
  return message;
}

/** Send a message. Its arrays are Float64Array with a `shape`. */
function send(message) {
  const arrays = Object.entries(message).filter(([, value]) => value instanceof Float64Array);
  const kinds = arrays.map(([name, { shape }]) => [name, '<f8', shape]);
  const text = Buffer.from(JSON.stringify({ ...message, ...Object.fromEntries(arrays.map(([name]) => [name])), arrays: kinds }));
  const prefix = Buffer.alloc(16, 'cv01'), data = arrays.map(([, value]) => Buffer.from(value.buffer));
  prefix.writeUInt32LE(text.length, 4);
  prefix.writeBigUInt64LE(BigInt(Buffer.concat(data).length), 8);
  write(Buffer.concat([prefix, text, ...data]));
}

const { resolve } = createRequire(`${process.argv[2]}/package.json`), runs = new Map(), engines = new Map();
let count = 0;

async function load(name) {
  const loaded = await import(pathToFileURL(resolve(name)));
  return loaded.default ?? loaded;
}

function call(run) {
  const start = performance.now(), samples = run();
  run.spent = (run.spent ?? 0) + performance.now() - start;
  return samples;
}

const operations = {
  check: async ({ module }) => (await load(module), {}),
  prepare: async ({ adapter, settings, ...numbers }) => {
    if (numbers.rows) return { error: 'unsupported', message: 'many bodies in one run' };
    const { ENGINE, start, prepare } = await import(pathToFileURL(adapter));
    if (!engines.has(adapter)) engines.set(adapter, await start(await load(ENGINE.package)));
    runs.set(++count, prepare({ ...numbers, ...settings }, engines.get(adapter)));
    return { run: count };
  },
  run: ({ run }) => call(runs.get(run)),
  time: ({ run, calls }) => {
    const measured = runs.get(run);
    while (!(measured.spent >= WARM_UP)) call(measured);
    let total = 0;
    for (let i = 0; i < calls; i++) {
      measured.renew();
      const start = performance.now();
      measured();
      total += performance.now() - start;
    }
    return { seconds: total / 1000 };
  },
};

async function answer({ do: name, forget, ...values }) {
  try {
    for (const run of forget) {
      runs.get(run)?.dispose(); // no collector reaches the memory of WebAssembly
      runs.delete(run);
    }
    return await operations[name](values);
  } catch (error) {
    return { error: error?.name ?? 'Error', message: String(error?.message ?? error).replace(/\s+/g, ' ').slice(0, 2000) };
  }
}

Object.defineProperty(process, 'stdout', { value: process.stderr }); // engines print
let hello = '';
while (!hello.endsWith('\n')) hello += read(1);
// The end of the client also ends a loop of an engine: another thread waits for it.
const socket = `new (require('net').Socket)({ fd: ${JSON.parse(hello).life} })`;
new Worker(`${socket}.on('close', () => process.kill(process.pid, 'SIGKILL')).resume()`, { eval: true }).unref();
// The client shows the last line of a crash: the message, below the stack.
process.on('uncaughtException', (error) => process.exit((console.error(String(error)), 1)));
write(Buffer.from(`{"protocol": 1, "program": "node", "version": "${process.versions.node}", "framing": "binary"}\n`));
for (;;) send(await answer(receive()));
