"""Every part of a scene crossed with every command and entry point that takes a scene.

In each cell the right motion is right, the motion without the part is not called right, or the part is refused by a message
that names it. `independent` has the right motions. A member of `Feature` without a row and a command without a column fail.
"""

from __future__ import annotations

import json
import pickle
import re
import shlex
import sys
import warnings
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from itertools import count, product
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from click.testing import CliRunner

import conservative as cv
from conservative import deferred_imports, registry
from conservative.benchmarks.suite.motion import motion_of
from conservative.benchmarks.verification.explain import Diagnosis
from conservative.features import Feature
from conservative.programs import Program
from conservative.references.engine import mass_model, principal_axes
from conservative.references.environments.plain_numbers import describe
from conservative.references.environments.programs import program_class
from conservative.references.truth import reference
from conservative.reports.cli.main import main
from conservative.scenes.random_body import FIELDS, name_of, random_body

from .crossing import APART, CORNER_FACTOR, CORNERS, RIGHT, ROWS, STEPS, J, Row, T, right_motion, write_file
from .environments import PATIENCE
from .independent import Case, angle_between, matrix_of, place
from .sampling import sampled


class Refused(Exception):
    """A command ended with the exit code for input that cannot be used."""


@dataclass(frozen=True, eq=False)
class Cell:
    """A row, a folder, and what its scenes are called in commands: a file, or a registered name."""

    row: Row
    folder: Path
    name: str
    other: str
    copy: str = ""
    without: str = ""
    program: Path = Path()

    def call(self, *arguments: str, codes: tuple[int, ...] = (0,)) -> Any:
        """Return the JSON that a command prints. Raise `Refused` with its message if it refuses."""
        done = CliRunner(env={"COLUMNS": "200"}).invoke(main, [*arguments, "--json"])
        if done.exit_code == 2:
            raise Refused(done.stderr)
        assert done.exit_code in codes, (done.exit_code, done.output[-2000:], done.exception)
        return json.loads(done.stdout)

    def check(self, t: Any, R_WB: Any, right: float = RIGHT) -> None:
        """Fail unless attitudes are those of the right motion."""
        assert self.row.distance(np.atleast_1d(t), np.asarray(R_WB)) < right

    def check_last(self, summary: Any) -> None:
        """Check the last state of a run in JSON, and that the error that is printed is the right one."""
        assert summary["outcome"]["kind"] == "ok"
        found = self.row.distance([summary["last"]["t"]], [summary["last"]["R_WB"]])
        assert found < RIGHT
        if "error" in summary:
            assert 0.8 * found - 1e-9 < summary["error"]["attitude"] < RIGHT


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a program that says that it takes rotors and free flight."""
    text = (Path(__file__).parent / "references" / "programs" / "engine.py").read_text()
    assert '{"order": 4}' in text
    path = tmp_path_factory.mktemp("program") / "engine.py"
    path.write_text(text.replace('{"order": 4}', '{"order": 4, "method_info": {"rotors": True, "flight": True}}'))
    return path


NUMBERS = count()


@pytest.fixture
def make_cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, program: Path) -> Callable[[Row], Cell]:
    """Return a function that makes cells; scenes that no file can have are registered for the time of the test."""
    monkeypatch.chdir(tmp_path)
    known, made = deferred_imports.list_entries, {}

    def list_entries(group: str) -> Any:
        builders = {
            name: SimpleNamespace(load=lambda build=build: build, value="tests", module=__name__)
            for name, build in made.items()
        }
        return known(group) | (builders if group == deferred_imports.SCENES else {})

    def make(row: Row) -> Cell:
        number, names = next(NUMBERS), []  # a process remembers the scenes of registered names
        cases = {"crossed": row.case, "another": row.other, "copy": row.case, "without": row.without}
        for name, case in cases.items():
            names.append(f"{name}_{number}")
            if row.in_file:
                names[-1] = str(write_file(tmp_path / f"{names[-1]}.toml", case))
            else:
                made[names[-1]] = partial(row.scene, case, names[-1])
        return Cell(row, tmp_path, *names, program=program)

    monkeypatch.setattr(deferred_imports, "list_entries", list_entries)
    monkeypatch.setattr(registry, "list_entries", list_entries)
    return make


@pytest.fixture
def cell(request: pytest.FixtureRequest, make_cell: Callable[[Row], Cell]) -> Cell:
    """Return the cell of a member of `Feature`."""
    return make_cell(ROWS[request.param])


# Entry points in Python


def integrate(cell: Cell) -> None:
    found = cv.integrate(cell.row.scene(), 0.004)
    cell.check(found.t[::5], found.R_WB[::5])
    if (flight := cell.row.case.flight) is not None:
        assert flight
        p, v = place(cell.row.case, found.t, found.R_WB, found.w_WB_B)
        assert np.abs(found.p_WB - p).max() < 1e-12
        assert np.abs(found.v_WB - v).max() < 1e-12


def integrate_samples(cell: Cell) -> None:
    cell.check(cell.row.t, cv.integrate(cell.row.scene(), 0.005, t_eval=cell.row.t).R_WB)


def integrate_corners(cell: Cell) -> None:
    """Beside the part there is a table with more corners than steps: samples at and between steps, alone and of many bodies."""
    case = cell.row.case
    added: dict[str, Any] = {"torque": CORNERS} if case.torque is None else {"damping": 0.3 * J, "factor": CORNER_FACTOR}
    case = replace(case, **added)
    row = replace(cell.row, case=case)
    scene = row.scene()
    method = "projected" if case.flight is None else "reduced"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cv.LoadNotResolved)
        alone = cv.integrate(scene, case.t_end / STEPS, method)
        between = cv.integrate(scene, case.t_end / STEPS, method, t_eval=cell.row.t)
        many = cv.integrate_many(scene, w_WB_B0=row.starts[:2], dt=case.t_end / STEPS, method=method, threads=1)
    assert row.distance(alone.t, alone.R_WB) < 1e-4
    assert row.distance(between.t, between.R_WB) < 1e-4
    check_many(row, many)


def integrate_error(cell: Cell) -> None:
    """The estimate and the step are not those of an earlier scene, which differs in this part only."""
    row = cell.row
    for case in (row.other, row.without, row.case):
        t = [0.0, 0.7, row.case.t_end]
        found = cv.integrate(row.scene(case), error=1e-7, t_eval=t)
        off = float(angle_between(found.R_WB, right_motion(case, t)[0]).max())
        assert off < 1e-7
        assert found.choice.estimate > 1e-3 * off


def pickled(cell: Cell) -> None:
    scene = cell.row.scene()
    named = [invariant.name for invariant in scene.invariants]  # cached with the scene
    again = pickle.loads(pickle.dumps(scene))
    assert [invariant.name for invariant in again.invariants] == named
    assert again.key == scene.key
    found = pickle.loads(pickle.dumps(cv.integrate(again, 0.005, t_eval=cell.row.t)))
    cell.check(cell.row.t, found.R_WB)
    assert all(np.isfinite(found.drift(invariant)).all() for invariant in found.scene.invariants)


def keys(cell: Cell) -> None:
    """A scene has the key of an equal one, and not that of one with another value of the part or without it."""
    row = cell.row
    assert row.scene().key == row.scene(name="equal").key
    assert len({row.scene(case).key for case in (row.case, row.without, row.other)}) == 3


def truth(cell: Cell) -> None:
    found = reference(cell.row.scene(), cv.Grid(cell.row.case.t_end / 8, 8))
    cell.check(cell.row.t, found.trajectory.R_WB, 1e-10)
    assert found.agreement_rad < 1e-9


def check_many(row: Row, found: cv.Ensemble) -> None:
    assert not found.failures
    for case, R_WB in zip(row.started, found.R_WB, strict=False):
        assert angle_between(right_motion(case, found.t)[0], np.asarray(R_WB)).max() < RIGHT


def integrate_many(cell: Cell) -> None:
    given = {"w_WB_B0": cell.row.starts, "dt": 0.005, "sample_every": 100}
    check_many(cell.row, cv.integrate_many(cell.row.scene(), **given, threads=1))


def integrate_many_error(cell: Cell) -> None:
    row = cell.row
    check_many(row, cv.integrate_many(row.scene(), w_WB_B0=row.starts, error=1e-5, dt=0.5, threads=1))


def stored(cell: Cell) -> None:
    """A folder is read with its scene; it is neither resumed nor read with another one."""
    pytest.importorskip("zarr")
    row, path = cell.row, cell.folder / "many.zarr"

    def run(case: Case, **options: Any) -> cv.Ensemble:
        given = {"w_WB_B0": row.starts, "dt": 0.02, "sample_every": 25, "threads": 1, "method": method}
        return cv.integrate_many(row.scene(case), **given, path=path, **options)

    method = "reduced:order=4" if cv.Reduced().unsupported(row.scene()) is None else "projected"
    run(row.case)
    check_many(row, cv.open_ensemble(path, row.scene()))
    if row.in_file:
        check_many(row, cv.open_ensemble(path))
    check_many(row, run(row.case, resume=True))
    for case in (row.other, row.without):
        with pytest.raises(cv.BadInput):
            cv.open_ensemble(path, row.scene(case))
        with pytest.raises(cv.BadInput):
            run(case, resume=True)


def dask(cell: Cell) -> None:
    pytest.importorskip("distributed")
    from .conservative.test_cluster import open_client, start, start_scheduler

    with ExitStack() as stack:
        address = start_scheduler(stack, cell.folder)
        client = stack.enter_context(open_client(address, PATIENCE))
        start(stack, cell.folder, "worker", address, "--nthreads", "1", "--no-nanny", "--host", "127.0.0.1")
        client.wait_for_workers(1, timeout=PATIENCE)
        given = {"w_WB_B0": cell.row.starts, "dt": 0.005, "sample_every": 100}
        check_many(cell.row, cv.integrate_many(cell.row.scene(), **given, client=client))


def protocol(cell: Cell) -> None:
    """A program that takes all that the protocol has: its numbers, as PROTOCOL.md explains them, are the motion."""
    command = shlex.join([sys.executable, "-I", str(cell.program)])
    reason = program_class(Program("crossing", cell.program, command))().unsupported(cell.row.scene())
    if reason is not None:
        raise Refused(reason)
    axes = principal_axes(cell.row.scene())
    assert mass_model(axes) is not None
    numbers = describe(axes, cv.Grid(0.01, 200))
    case = Case(np.diag(numbers["moments"]), matrix_of(numbers["q0"]), numbers["w0"], cell.row.case.t_end)
    fields = {
        "gravity": (numbers["mass"] * numbers["gravity"], numbers["com"]),
        "spring": (numbers["stiffness"], numbers["point"], numbers["anchor"], numbers["rest_length"]),
        "attraction": (numbers["strength"], numbers["point"], numbers["anchor"]),
        "gradient": (1 / np.sqrt(3), numbers["gradient"], numbers["direction"]),
    }
    acting = {"gravity": numbers["mass"] * numbers["gravity"], "spring": numbers["stiffness"]}
    acting |= {"attraction": numbers["strength"], "gradient": np.abs(numbers["gradient"]).max()}
    if "p_WB0" not in numbers:
        for kind, size in acting.items():
            case = replace(case, field=(kind, *fields[kind])) if size else case
    if (rate := float(np.linalg.norm(numbers["turn"]))) > 0:
        case = replace(case, turning=(rate, numbers["turn"] / rate))
    case = replace(case, rotor=numbers.get("rotor"))
    assert numbers["free"] == (case.field is None)
    cell.check(cell.row.t, right_motion(case, cell.row.t)[0] @ axes.R_BF.T, 1e-9)


def gate(cell: Cell) -> None:
    """Two versions of a project are compared on the same scene only."""
    assert motion_of(cell.name).key == motion_of(cell.copy).key
    assert len({motion_of(name).key for name in (cell.name, cell.other, cell.without)}) == 3


# Commands


def run(cell: Cell) -> None:
    cell.check_last(cell.call("run", cell.name, "--dt", "0.004"))
    chosen = cell.call("run", cell.name)  # method and step, for an error of 1e-6 rad
    cell.check_last(chosen)
    assert (chosen["status"], chosen["choice"]["reached"]) == ("ok", True)


def run_odd_step(cell: Cell) -> None:
    """The last step passes the end of the run, and of a table."""
    cell.check_last(cell.call("run", cell.name, "--dt", "0.0037"))


def watch(cell: Cell) -> None:
    found = cell.call("watch", cell.name, "--dt", "0.004", "--out", "motion.html")
    cell.check_last(found["runs"][0])


def recommend(cell: Cell) -> None:
    """The cheapest setting reaches the error."""
    found = cell.call("recommend", cell.name, "--error", "1e-4", "--engines", "scipy")
    assert found["cheapest"]
    scene = cell.row.scene()
    for each in found["recommendations"]:
        if each["reached"]:
            motion_of = cv.integrate(scene, each["best"].get("dt") or scene.t_end / 8, each["best"]["method"])
            cell.check(motion_of.t, motion_of.R_WB, 1.5e-4)


def sweep(cell: Cell) -> None:
    pytest.importorskip("zarr")
    options = ("--starts", "2", "--spread", "rate=1e-9rad/s", "--dt", "0.005", "--out", "swept.zarr", "--threads", "1")
    found = cell.call("sweep", cell.name, *options)
    assert found
    many = cv.open_ensemble("swept.zarr", None if cell.row.in_file else registry.scene(cell.name))
    for i in range(2):
        cell.check(many.t, np.asarray(many.R_WB[i]))


def verify(cell: Cell) -> None:
    """The right motion is right, and the motion without the part is wrong; what explains it is left out, because it is slow."""
    with patch("conservative.benchmarks.verification.recordings.verdict.diagnose", return_value=Diagnosis()):
        verify_and_explain(cell)


def verify_and_explain(cell: Cell) -> None:
    for case, right in ((cell.row.case, True), (cell.row.without, False)):
        R_WB, w = right_motion(case, T)
        write_motion(cell.folder / "run.csv", R_WB, w)
        found = cell.call("verify", "run.csv", "--body", cell.name, codes=(0, 1, 3))
        assert (found["verdict"] == "right") is right, found["subjects"]
        assert not right or max(found["subjects"][0]["details"]["error"]) < 1e-9


def verify_later(cell: Cell) -> None:
    """A file that begins after t = 0 is compared at its own times."""
    R_WB, w = right_motion(cell.row.case, T)
    write_motion(cell.folder / "run.csv", R_WB, w, 50)
    with patch("conservative.benchmarks.verification.recordings.verdict.diagnose", return_value=Diagnosis()):
        found = cell.call("verify", "run.csv", "--body", cell.name, codes=(0, 1, 3))
    assert found["verdict"] == "right", found["subjects"]


def write_motion(path: Path, R_WB: Any, w: Any, first: int = 0) -> None:
    """Write times, attitudes and rates with 16 digits."""
    columns = ["t", *(f"R_WB_{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)), "w_x (rad/s)", "w_y (rad/s)", "w_z (rad/s)"]
    values = np.column_stack([T, R_WB.reshape(-1, 9), w])[first:]
    np.savetxt(path, values, delimiter=",", header=",".join(columns), comments="", fmt="%.17g")


def study(cell: Cell) -> None:
    """Errors of a study fall to those of a right motion."""
    found = cell.call("study", "convergence", "--scenes", cell.name, "--methods", "reduced,projected", "--quick")
    check_rows(found["rows"])


def report(cell: Cell) -> None:
    words = ["--methods", "reduced,projected", "--quick", "--out", "page", "--bodies", "0", "--time-limit", "0.02"]
    check_rows(cell.call("report", "--scenes", cell.name, *words)["rows"])


def check_rows(rows: Any) -> None:
    """Some attitude error is small, and so the truth is not another motion."""
    errors = [row["value"] for row in rows if "attitude" in row["measure"]]
    assert errors
    assert min(error for error in errors if error is not None) < 1e-4


COMMANDS = {
    "run": (run, run_odd_step),
    "watch": (watch,),
    "recommend": (recommend,),
    "sweep": (sweep,),
    "verify": (verify, verify_and_explain, verify_later),
    "study": (study,),
    "report": (report,),
    "gate": (gate,),
    "track": (protocol,),  # engines in environments get the numbers of the protocol
}
"""Columns of the commands that take a scene."""
ENTRIES = (
    integrate,
    integrate_samples,
    integrate_corners,
    integrate_error,
    integrate_many,
    integrate_many_error,
    stored,
    dask,
    pickled,
    keys,
    truth,
)
SLOW = (dask, report, study, recommend, verify_and_explain, integrate_many_error)
NEVER = (integrate, integrate_samples, integrate_error, pickled, keys, truth, run, run_odd_step, watch, verify)
NEVER += (verify_and_explain, verify_later, gate)
"""Columns that take every part: a refusal is a failure there."""
columns = [*ENTRIES, *(column for each in COMMANDS.values() for column in each)]
METHODS = registry.list_methods()
OF_SCENES = {"scene", "scenes", "body"}
"""Parameters of commands that are scenes."""


def check(cell: Cell, column: Any, may_refuse: bool = True) -> None:
    """Run a cell; a refusal has to name the part."""
    refusal = ""
    try:
        column(cell)
    except (Refused, cv.BadInput) as refused:
        refusal = str(refused)
    assert may_refuse or not refusal, f"refused: {refusal}"
    words = "|".join(map(re.escape, cell.row.words))
    assert not refusal or re.search(words, refusal), f"a refusal that does not name the part: {refusal}"


VARYING = {Feature.TURNING, Feature.TIME, Feature.MOTOR, Feature.TORQUE}
"""Parts that depend on time."""
IN_FILES = {feature for feature in Feature if ROWS[feature].in_file}
DEFAULT = {
    **{column: set([*Feature][i % 2 :: 2]) for i, column in enumerate((run, stored, integrate_many, verify, truth))},
    integrate_corners: {Feature.TORQUE, Feature.FLIGHT},
    run_odd_step: {Feature.GRAVITY, Feature.FLIGHT, *VARYING},
    verify_later: {Feature.ROTOR, *VARYING},
    watch: IN_FILES,
    sweep: IN_FILES,
    **{column: set() for column in SLOW},
}
"""Parts of the default run, in columns that do not have all: other cells of `SLOW` take seconds, of the others they repeat.

Each part is in every other one of the columns that integrate a scene once more."""


def marks(column: Any, feature: Feature) -> list[pytest.MarkDecorator]:
    return [] if feature in DEFAULT.get(column, set(Feature)) else [pytest.mark.slow]


@pytest.mark.parametrize(
    ("column", "cell"),
    [
        pytest.param(column, feature, id=f"{column.__name__}-{feature.name}", marks=marks(column, feature))
        for column in columns
        for feature in Feature
    ],
    indirect=["cell"],
)
def test_a_part_is_right_or_refused(cell: Cell, column: Any) -> None:
    check(cell, column, column not in NEVER)


SCENES = {feature: ROWS[feature].scene() for feature in Feature}


def supported(method: str, feature: Feature) -> bool:
    return registry.method(method).unsupported(SCENES[feature]) is None


@pytest.mark.parametrize("method", METHODS)
def test_a_method_refuses_to_prepare_what_it_does_not_support(method: str) -> None:
    for feature in Feature:
        scene, chosen = ROWS[feature].scene(), registry.method(method)
        if not supported(method, feature):
            with pytest.raises(cv.Unsupported) as refusal:
                chosen.prepare(scene, cv.Grid(0.005, 400, 50))
            for each in scene.features - chosen.supports:
                assert each.value in str(refusal.value)


@pytest.mark.parametrize(
    ("method", "feature"),
    sampled([pair for pair in product(METHODS, Feature) if supported(*pair)], 16, [("scipy", Feature.TORQUE)]),
)
def test_prepare_and_check_are_right(method: str, feature: Feature) -> None:
    row, grid, chosen = ROWS[feature], cv.Grid(0.005, 400, 50), registry.method(method)
    scene = row.scene()
    found = chosen.check(scene, grid, chosen.prepare(scene, grid)())
    assert found.ok, found.outcome
    assert row.distance(row.t, found.R_WB) < 0.1  # methods of order 1 and 2


@pytest.mark.parametrize("feature", Feature, ids=lambda feature: feature.name)
def test_a_gate_that_ignores_a_part_is_seen(feature: Feature, make_cell: Callable[[Row], Cell]) -> None:
    """Every cell of the column `gate` fails if the scenes of the gate are without the part, or without its value."""
    row = ROWS[feature]
    gate(make_cell(row))
    for wrong in (replace(row, case=row.without), replace(row, other=row.case)):
        with pytest.raises(AssertionError):
            gate(make_cell(wrong))


@pytest.mark.parametrize("field", FIELDS)
def test_a_body_of_the_random_study_is_the_scene_of_its_name(field: str) -> None:
    assert registry.scene(name_of(field, 7, 3)).key == random_body(field, 7, 3).key


def test_every_part_has_a_row() -> None:
    assert set(ROWS) == set(Feature)
    for feature, row in ROWS.items():
        assert feature in row.scene().features
        assert feature not in row.scene(row.without).features
        assert row.distance(row.t, right_motion(row.without, row.t)[0]) > APART  # measured: from 0.39
        assert row.distance(row.t, right_motion(row.other, row.t)[0]) > 10 * RIGHT  # measured: from 0.21


def test_a_jump_of_all_components_is_a_break() -> None:
    assert ROWS[Feature.TORQUE].scene().breaks.tolist() == [0.5, 0.8, 1.3, 2.0]


def test_every_command_that_takes_a_scene_has_a_column() -> None:
    def supports(command: Any) -> bool:
        inner = getattr(command, "commands", {}).values()
        return any(param.name in OF_SCENES for param in command.params) or any(map(supports, inner))

    assert {name for name, command in main.commands.items() if supports(command)} == set(COMMANDS)


def test_a_wrong_motion_is_not_called_right(tmp_path: Path) -> None:
    """The check of the cells sees a motion without the part."""
    row = ROWS[Feature.ROTOR]
    cell = Cell(row, tmp_path, "", "")
    cell.check(row.t, right_motion(row.case, row.t)[0])
    with pytest.raises(AssertionError):
        cell.check(row.t, right_motion(row.without, row.t)[0])
    with pytest.raises(AssertionError, match="does not name"):
        check(cell, lambda cell: (_ for _ in ()).throw(cv.BadInput("scene", "something", "something else")))
