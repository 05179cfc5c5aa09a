/* The program that runs an engine in JavaScript: what program.py is for Python. It speaks the protocol of PROTOCOL.md in the
 * framing "binary", for one body per run, and uses no packages.
 *
 *   node program.js FOLDER      the packages are in FOLDER/node_modules
 *
 * An adapter is a file with a function `prepare(given, load)`, which may be async; `load()` returns the package of the engine. It
 * returns a run, a function that returns samples (see engines/shared.js). A run may have `renew` and `dispose`, as in Python.
 */
'use strict';
const fs = require('fs');
const { createRequire } = require('module');
const { join } = require('path');
const { pathToFileURL } = require('url');
const { Worker } = require('worker_threads');

const WARM_UP = 20;  // ms in unmeasured calls before a run is measured
const TYPES = { '<f8': Float64Array, '<i8': BigInt64Array };

function read(count) {
  const data = Buffer.alloc(count);
  for (let start = 0; start < count;) {
    const part = fs.readSync(0, data, start, count - start);
    if (part === 0) process.kill(process.pid, 'SIGKILL');  // the client is gone
    start += part;
  }
  return data;
}

function readLine() {
  let line = '';
  while (!line.endsWith('\n')) line += read(1).toString('latin1');
  return JSON.parse(line);
}

const revive = (name, value) => ({ nan: NaN, inf: Infinity, '-inf': -Infinity }[value] ?? value);

function receive() {
  const prefix = read(16);
  const text = read(prefix.readUInt32LE(4)), data = read(Number(prefix.readBigUInt64LE(8)));
  const { arrays, ...message } = JSON.parse(text, revive);
  let start = data.byteOffset;
  for (const [name, kind, shape] of arrays) {
    const type = TYPES[kind], end = start + shape.reduce((a, b) => a * b, type.BYTES_PER_ELEMENT);
    message[name] = Array.from(new type(data.buffer.slice(start, end)), Number);
    start = end;
  }
  return message;
}

function send(message) {
  const arrays = Object.entries(message).filter(([, value]) => value instanceof Float64Array);
  const plain = (name, value) => {
    if (value instanceof Float64Array) return undefined;  // not in the JSON
    return typeof value === 'number' && !Number.isFinite(value) ? `${value}`.toLowerCase().replace('inity', '') : value;
  };
  const kinds = arrays.map(([name, value]) => [name, '<f8', value.shape]);
  const text = Buffer.from(JSON.stringify({ ...message, arrays: kinds }, plain));
  const parts = arrays.map(([, value]) => Buffer.from(value.buffer)), prefix = Buffer.alloc(16, 'cv01');
  prefix.writeUInt32LE(text.length, 4);
  prefix.writeBigUInt64LE(BigInt(parts.reduce((sum, part) => sum + part.length, 0)), 8);
  write(Buffer.concat([prefix, text, ...parts]));
}

function write(data) {
  for (let start = 0; start < data.length;) start += fs.writeSync(1, data, start);
}

const resolve = createRequire(join(process.argv[2] ?? '.', 'package.json')).resolve;

async function load(name) {
  const loaded = await import(pathToFileURL(resolve(name)));
  return loaded.default ?? loaded;
}

const runs = new Map();
let count = 0;

function call(run) {
  const start = performance.now(), samples = run();
  run.spent = (run.spent ?? 0) + performance.now() - start;
  return samples;
}

const operations = {
  check: async ({ module }) => { await load(module); return {}; },
  prepare: async ({ adapter, settings, ...numbers }) => {
    if ('rows' in numbers) return { error: 'unsupported', message: 'many bodies in one run' };
    const { ENGINE, prepare } = require(adapter);
    runs.set(++count, await prepare({ ...numbers, ...settings }, () => load(ENGINE.module)));
    return { run: count };
  },
  run: ({ run }) => call(runs.get(run)),
  time: ({ run, calls }) => {
    const measured = runs.get(run);
    while (!(measured.spent >= WARM_UP)) call(measured);
    let total = 0;
    for (let i = 0; i < calls; i++) {
      measured.renew?.();
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
      runs.get(run)?.dispose?.();  // a collector does not reach the memory of WebAssembly
      runs.delete(run);
    }
    if (!Object.hasOwn(operations, name)) throw new TypeError(`no operation ${name}`);
    return await operations[name](values);
  } catch (error) {
    return { error: error?.name ?? 'Error', message: String(error?.message ?? error).replace(/\s+/g, ' ').slice(0, 2000) };
  }
}

async function serve() {
  Object.defineProperty(process, 'stdout', { value: process.stderr });  // engines print
  const { life } = readLine();
  const watch = `new (require('net').Socket)({ fd: ${life} }).on('close', () => process.kill(process.pid, 'SIGKILL')).resume()`;
  new Worker(watch, { eval: true }).unref();  // also while this thread is in an engine's loop
  const greeting = { protocol: 1, program: 'node', version: process.versions.node, framing: 'binary' };
  write(Buffer.from(JSON.stringify(greeting) + '\n'));
  for (;;) send(await answer(receive()));
}

// The client shows the last line: the message, not the stack.
process.on('uncaughtException', (error) => { fs.writeSync(2, `${error}\n`); process.exit(1); });
serve();
