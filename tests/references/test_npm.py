"""Engines in JavaScript: environments that npm makes from a registry on this machine, and the program that runs an adapter."""

import base64
import hashlib
import io
import json
import shutil
import tarfile
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.grid import grid_for
from conservative.references.engine import principal_axes
from conservative.references.environments import environment, folders, install
from conservative.references.environments.adapter import read_script
from conservative.references.environments.engine_method import engine_class
from conservative.references.environments.kind import Distribution, Lock, Source
from conservative.references.environments.npm import Npm
from conservative.references.environments.plain_numbers import describe
from conservative.references.worker.client import EngineCrashed

from ..environments import run_python
from .test_workers import wait_for_end

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not shutil.which("npm"), reason="needs Node and npm")]
ADAPTER = """/* Trial engine.
 * Second line.
 */
export const ENGINE = {"package": "@trial/engine", "settings": {"trouble": "none"}};
export const start = (engine) => engine();

export function build({ q0, w0_W, steps, trouble }, engine, own) {
  console.log('engines print');
  if (trouble === 'throw') throw new RangeError('too\\n  large');
  for (const all = []; trouble === 'grow'; ) all.push(new Array(1e6).fill(0.5));
  while (trouble === 'spin');
  own({ name: 'first' });
  own(() => engine.destroyed.push('second'));
  let done = 0;
  const alive = () => engine.made - engine.destroyed.length / 2;
  const read = () => [q0, trouble === 'diverge' && done > 2 ? [NaN, NaN, NaN] : [done, alive(), 0]];
  engine.made++;
  return { step: () => done++, read };
}
"""
PACKAGE = "module.exports = () => { const engine = { made: 0, destroyed: [] };" + (
    "engine.destroy = ({ name }) => engine.destroyed.push(name); return engine; };"
)
SCENE = cv.scenes.brick_flip(t_end=0.05)


def tarball(version):
    data = io.BytesIO()
    files = {"package.json": json.dumps({"name": "@trial/engine", "version": version, "main": "a.js"}), "a.js": PACKAGE}
    with tarfile.open(fileobj=data, mode="w:gz") as archive:
        for name, text in files.items():
            info = tarfile.TarInfo(f"package/{name}")
            info.size = len(text)
            archive.addfile(info, io.BytesIO(text.encode()))
    return data.getvalue()


@pytest.fixture(scope="module")
def address():
    """Yield the address of a registry with three versions of a package, and a preliminary one."""
    archives = {version: tarball(version) for version in ("1.0.0", "1.9.0", "1.10.0", "2.0.0-beta.1")}

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            host = f"http://127.0.0.1:{server.server_port}"
            if self.path.endswith(".tgz"):
                content = archives[self.path[1:-4]]
            elif self.path == "/@trial%2fengine":
                dist = {
                    version: {
                        "tarball": f"{host}/{version}.tgz",
                        "integrity": f"sha512-{base64.b64encode(hashlib.sha512(archive).digest()).decode()}",
                    }
                    for version, archive in archives.items()
                }
                versions = {each: {"name": "@trial/engine", "version": each, "dist": dist[each]} for each in dist}
                page = {"name": "@trial/engine", "versions": versions, "dist-tags": {"latest": "1.10.0"}}
                content = json.dumps(page).encode()
            else:
                return self.send_error(404)
            self.send_response(200)
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *arguments):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    server.server_close()


@pytest.fixture(autouse=True)
def trial(address, no_environments, tmp_path, monkeypatch):
    """Let the test engine be the one in JavaScript, and return its adapter."""
    monkeypatch.setenv("npm_config_registry", address)
    monkeypatch.setenv("npm_config_fetch_retries", "0")
    monkeypatch.setenv("npm_config_userconfig", str(tmp_path / "no_npmrc"))
    monkeypatch.delenv("npm_config_cache", raising=False)
    adapter = tmp_path / "trial.mjs"
    adapter.write_text(ADAPTER)
    monkeypatch.setattr(registry.engine("trial"), "data", Distribution("@trial/engine", "@trial/engine", kind="npm"))
    return adapter


@pytest.fixture
def worker():
    worker = install.install("trial").environment.start_worker(memory=1 << 30)
    yield worker
    worker.close()


def prepare(worker, adapter, trouble="none"):
    numbers = describe(principal_axes(SCENE), grid_for(SCENE, 0.01))
    return worker.ask("prepare", adapter=str(adapter), settings={"trouble": trouble}, **numbers)["run"]


def test_the_newest_release_is_installed_and_locked_without_a_registry(address, tmp_path):
    done = install.install("trial")
    created = done.environment
    assert (created.version, done.new, done.trouble, created.kind) == ("1.10.0", True, "", Npm())
    assert created.runtime.startswith("Node ")
    assert created.packages == ("@trial/engine==1.10.0",)
    lock = (created.folder / Npm.lock_file).read_text()
    assert "sha512-" in lock
    assert '"resolved"' not in lock
    assert environment.list_environments() == (created,)
    shutil.rmtree(created.folder / "node_modules")
    environment.close_environment(created.folder)  # its worker has loaded the package
    assert "Cannot find" in install.install("trial").trouble
    again = install.install("trial", force=True)
    assert (again.environment, again.trouble) == (created, "")
    assert {path.name for path in tmp_path.iterdir()} == {"cache", "trial_engine-1.0.dist-info", "trial.mjs"}


def test_versions(monkeypatch):
    assert install.newest_releases("trial", 2, Source()) == ("1.9.0", "1.10.0")
    assert install.install("trial==1.9.0").environment.version == "1.9.0"
    with pytest.raises(cv.BadInput, match=r"'@trial/engine==3.0'; expected one of 1.10.0, 1.9.0, 1.0.0"):
        install.install("trial==3.0")
    with pytest.raises(cv.BadInput, match="find_links"):
        install.install("trial==1.0.0", Source(find_links=folders.folder_of_all()))
    monkeypatch.setenv("npm_config_registry", "http://me:secret@127.0.0.1:9/")
    with pytest.raises(cv.BadInput, match=r"ECONNREFUSED.*; expected a network") as caught:
        install.install("trial==1.0.0")
    assert "secret" not in str(caught.value)


def test_a_missing_or_old_node_is_named_with_the_one_to_install(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    with pytest.raises(cv.BadInput, match="but no npm on this machine; expected Node 20 or later"):
        install.install("trial")
    old = tmp_path / "bin" / "node"
    old.parent.mkdir()
    old.write_text("#!/bin/sh\necho 18.0.0\n")
    old.chmod(0o755)
    with pytest.raises(cv.BadInput, match=r"but Node 18\.0\.0; expected Node 20"):
        Npm().fill(tmp_path, Lock("1", "{}"), Source())


def test_a_run_and_what_it_owns(worker, trial):
    runs = [prepare(worker, trial) for _ in range(2)]
    for _ in range(3):  # objects of a call are destroyed before the next one is built
        for run in runs:
            answer = worker.ask("run", run=run)
    rates = np.array(answer["w_W"])
    assert np.array_equal(rates[1:, 0], np.arange(1, 6))
    assert np.array_equal(rates[0], SCENE.w_WB_B0)
    assert rates[1, 1] == 2  # alive: one world for each run
    assert worker.ask("time", run=runs[0], calls=3)["seconds"] > 0
    worker.forget(worker.starts, runs[1])
    assert worker.ask("run", run=runs[0])["w_W"][1][1] == 1


def test_failures_are_reported(worker, trial):
    with pytest.raises(EngineCrashed, match="RangeError: too large"):
        worker.ask("run", run=prepare(worker, trial, "throw"))
    assert np.isnan(np.array(worker.ask("run", run=prepare(worker, trial, "diverge"))["w_W"], float)).sum() == 9
    with pytest.raises(NotImplementedError, match="many bodies"):
        worker.ask("prepare", adapter=str(trial), settings={}, rows=["q0"])
    with pytest.raises(EngineCrashed, match="out of memory"):
        worker.ask("run", run=prepare(worker, trial, "grow"))
    assert worker.ask("run", run=prepare(worker, trial))["q"][5] == worker.ask("run", run=prepare(worker, trial))["q"][0]


def test_it_ends_with_its_client(trial):
    install.install("trial")
    numbers = {"free": True, "q0": [1, 0, 0, 0], "w0_W": [0, 0, 1], "com": [0, 0, 0], "q_com": [1, 0, 0, 0], "steps": [0, 1]}
    code = (
        "import os, threading, time\n"
        "from conservative.references.environments.environment import find_environment\n"
        "worker = find_environment('trial').start_worker()\n"
        f"run = worker.ask('prepare', adapter={str(trial)!r}, settings=dict(trouble='spin'), **{numbers})['run']\n"
        "threading.Thread(target=worker.ask, args=('run',), kwargs=dict(run=run), daemon=True).start()\n"
        "time.sleep(0.5); print(worker.pid, flush=True); os._exit(0)\n"
    )
    status, out, errors = run_python(code)
    assert status == 0, errors
    wait_for_end(int(out))


def test_the_data_of_an_adapter(trial):
    module = read_script(trial)
    assert module.__doc__.splitlines()[:2] == ["Trial engine.", " Second line."]
    method = engine_class(module)
    assert (method.data.kind, method.data.module, method.data.precision) == ("npm", "@trial/engine", "f32")
    assert method.data.settings == {"trouble": "none"}
