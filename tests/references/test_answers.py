"""Every field of every answer of a program, of another kind or missing: a sentence with the program and the field."""

import json
import sys
from pathlib import Path

import pytest

import conservative as cv
from conservative.programs import Program
from conservative.references.environments.programs import DESCRIPTION, UnusableProgram, _check_description, program_class
from conservative.references.worker.client import ANSWERS, EngineCrashed, EngineError, Worker
from conservative.references.worker.program import from_json

ENGINE = (Path(__file__).parent / "programs" / "engine.py").read_text()
BRICK = cv.scenes.brick_flip(t_end=0.1)
GIVEN = {"settings": {}, "free": True, "q0": [1, 0, 0, 0], "w0": [0, 0.05, 10], "moments": [13, 5, 10], "dt": 0.01}
GIVEN |= {"n_steps": 2, "steps": [0, 1, 2]}
HUGE = "1" + "0" * 400
NO_NUMBER = ["true", "-1", "-1e-300", '"x"', "[]", "{}", "NaN", "Infinity", '"nan"', '"inf"', '"-inf"', HUGE]
NO_TEXT = ["true", "-1", "[]", "{}", "NaN"]
NO_ARRAY = ["true", "-1", "NaN", '"x"', "{}", '"inf"', HUGE, '[["1"]]', "[[true, 1.0]]", "[[1, 2], 3]", f"[{HUGE}]"]
WRONG = {
    ("hello", "protocol"): NO_NUMBER,
    ("hello", "program"): NO_TEXT,
    ("hello", "version"): NO_TEXT,
    ("hello", "framing"): [*NO_TEXT, '"x"'],
    ("hello", "engine"): ["true", "-1", '"x"', "[]", "NaN"],
    ("prepare", "run"): NO_NUMBER,
    ("run", "q"): NO_ARRAY,
    ("run", "w"): NO_ARRAY,
    ("run", "evaluations"): ["true", "-1", "NaN", '"x"', "{}", '"inf"', HUGE, '[["1"]]', "[[true, 1.0]]"],
    ("run", "steps"): ["true", "-1", "NaN", '"x"', "{}", '"inf"', HUGE, '[["1"]]', "[[true, 1.0]]"],
    ("run", "reason"): NO_TEXT,
    ("time", "seconds"): NO_NUMBER,
}
"""JSON of wrong values of each field. They are not taken from the rules of the client, which they test."""
UNREADABLE = ["1" * 5000, "[" * 10_000 + "]" * 10_000, "1, 2"]


def written(folder, do, field, text):
    """Return the command of a program whose answer to `do` has the `field` with a value, in JSON; None for no such field."""
    change = f"    if json.loads(line)['do'] == {do!r}:\n        response.pop({field!r}, None)\n"
    if text is not None:
        change += f"        response[{field!r}] = 'PLACE'\n"
    code = ENGINE.replace(
        "    print(json.dumps(response)", f"{change}    print(json.dumps(response).replace('\"PLACE\"', TEXT)"
    )
    (folder / "wrong.py").write_text(f"TEXT = {text or 'null'!r}\n{code}")
    return sys.executable, str(folder / "wrong.py")


def ask(command, do):
    worker = Worker(command)
    try:
        if do == "hello":
            return worker.greet()
        prepared = worker.ask("prepare", **GIVEN)
        if do == "prepare":
            return prepared["run"]
        answer = worker.ask(do, run=prepared["run"], **({"calls": 1} if do == "time" else {}))
        return [answer["q"], answer["w"]] if do == "run" else answer["seconds"]
    finally:
        worker.close()


ALIKE = {"R", "w_W", "p", "v"}
"""Fields with the rule of `q`."""


def test_every_field_has_wrong_values():
    fields = {(do, field) for do, fields in ANSWERS.items() if do != "load" for field in fields}
    assert fields == set(WRONG) | {("run", field) for field in ALIKE}
    assert {ANSWERS["run"][field] for field in ALIKE} == {ANSWERS["run"]["q"]}


@pytest.mark.parametrize(("do", "field"), WRONG)
def test_every_field_of_another_kind_is_named(do, field, tmp_path):
    for text in WRONG[do, field]:
        value = from_json(f'{{"value": {text}}}'.encode())["value"]
        with pytest.raises(EngineCrashed, match=rf"my_program answers `{do}` with `{field}`"):
            Worker(["my_program"])._check(do, {field: value})
    for text in (WRONG[do, field][0], *UNREADABLE[: 3 * (field in ("protocol", "q", "seconds"))]):
        with pytest.raises(EngineCrashed, match=f"`{field}`|an answer that cannot be read from {sys.executable}"):
            ask(written(tmp_path, do, field, text), do)
    needed = {"prepare": ["run"], "run": ["q", "w"], "time": ["seconds"], "hello": ["protocol"]}[do]
    if field in needed:
        with pytest.raises(EngineCrashed, match=f"no `{field}`|should speak version 1"):
            ask(written(tmp_path, do, field, None), do)
    else:
        ask(written(tmp_path, do, field, None), do)


@pytest.mark.parametrize("text", ["-0.5", "NaN", '"nan"', "-Infinity", '"inf"'])
def test_a_time_that_is_negative_or_no_number_is_an_outcome(text, tmp_path):
    run = program_class(Program("wrong", tmp_path / "conservative.toml", " ".join(written(tmp_path, "time", "seconds", text))))
    with pytest.raises(EngineCrashed, match="`time` with `seconds`"):
        run().prepare(BRICK, cv.Grid(0.01, 10)).own_loop.wall_time(1)


@pytest.mark.parametrize("text", [None, '""', "null"])
@pytest.mark.parametrize(("error", "kind"), [("unsupported", NotImplementedError), ("ValueError", EngineError)])
def test_an_error_without_a_message(error, kind, text, tmp_path):
    command = written(tmp_path, "prepare", "message", text)
    code = Path(command[1]).read_text().replace("response.pop('message', None)", f"response = {{'error': {error!r}}}")
    Path(command[1]).write_text(code)
    with pytest.raises(kind, match="no reason: no `message`"):
        ask(command, "prepare")


def test_an_error_or_a_message_of_another_kind_or_of_any_length(tmp_path):
    for field, text in (("error", "5"), ("error", "[1]"), ("error", "null"), ("message", "5")):
        with pytest.raises(EngineCrashed, match=f"`{field}`"):
            ask(written(tmp_path, "prepare", field, text), "prepare")
    command = written(tmp_path, "prepare", "error", json.dumps("broken"))
    code = Path(command[1]).read_text().replace("response.pop('error', None)", "response['message'] = 'x' * 10**7")
    Path(command[1]).write_text(code)
    with pytest.raises(EngineError) as caught:
        ask(command, "prepare")
    assert 1000 < len(str(caught.value)) < 4000


def test_times_that_are_none_are_outcomes_of_a_run(tmp_path):
    command = written(tmp_path, "run", "q", '[["1", 0, 0, 0]]')
    made = program_class(Program("wrong", tmp_path / "conservative.toml", " ".join(command)))
    with pytest.raises(EngineCrashed, match="`q`"):
        cv.integrate(BRICK, 0.01, made())
    assert str(cv.integrate(BRICK, 0.01, made(), on_failure="return").outcome.kind) == "crashed"


@pytest.mark.parametrize("field", ["steps", "evaluations"])
@pytest.mark.parametrize("text", ["[0, 1, 2]", "2.5"])  # the steps of the request, and no count
def test_a_count_of_one_run_is_one_whole_number(field, text, tmp_path):
    made = program_class(Program("wrong", tmp_path / "conservative.toml", " ".join(written(tmp_path, "run", field, text))))
    with pytest.raises(EngineCrashed, match=f"`{field}`: .*expected a whole number"):
        cv.integrate(BRICK, 0.01, made())


@pytest.mark.parametrize("field", DESCRIPTION)
def test_every_field_of_a_description_of_another_kind_is_named(field, tmp_path):
    is_right, _ = DESCRIPTION[field]
    inside = field in ("variants", "flight", "rotors")
    values = [each for each in (5, -1, "x", True, None, [1], [[]], {"a": [1]}, {"a": {}}, ["f16"]) if not is_right(each)]
    assert len(values) >= 4
    for value in values:
        with pytest.raises(ValueError, match=f"`{field}` is "):
            _check_description({"method_info": {field: value}} if inside else {field: value})
    command = written(
        tmp_path, "hello", "engine", json.dumps({"method_info": {field: values[0]}} if inside else {field: values[0]})
    )
    with pytest.raises(UnusableProgram, match=f"wrong, a program of .*`{field}`"):
        program_class(Program("wrong", tmp_path / "conservative.toml", " ".join(command)))
