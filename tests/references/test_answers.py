"""Every field of every answer of a program, of another kind or missing: a sentence with the program and the field."""

import json
import sys
from pathlib import Path

import pytest

import conservative as cv
from conservative.programs import Program
from conservative.references.environments.programs import DESCRIPTION, UnusableProgram, _check_description, program_class
from conservative.references.worker.client import ANSWERS, EngineCrashed, EngineError, Worker

ENGINE = (Path(__file__).parent / "programs" / "engine.py").read_text()
BRICK = cv.scenes.brick_flip(t_end=0.1)
GIVEN = {"settings": {}, "free": True, "q0": [1, 0, 0, 0], "w0": [0, 0.05, 10], "moments": [13, 5, 10], "dt": 0.01}
GIVEN |= {"n_steps": 2, "steps": [0, 1, 2]}
TEXTS = ["true", "-1", '"x"', "[]", "{}", '"inf"', "1" + "0" * 400, '[["1"]]', "[[true, 1.0]]", "[[1, 2], 3]"]
"""JSON of wrong values."""
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


FIELDS = [
    (do, field) for do, fields in ANSWERS.items() if do != "load" for field in fields if field not in ("R", "w_W", "p", "v")
]


@pytest.mark.parametrize(("do", "field"), FIELDS)
def test_every_field_of_another_kind_is_named(do, field, tmp_path):
    is_right, _ = ANSWERS[do][field]
    wrong = [value for value in (json.loads(text) for text in TEXTS) if not is_right(value)]
    assert len(wrong) >= 5
    for value in wrong:
        with pytest.raises(EngineCrashed, match=rf"my_program answers `{do}` with `{field}`"):
            Worker(["my_program"])._check(do, {field: value})
    for text in (json.dumps(wrong[0]), *UNREADABLE[: 3 * (field in ("protocol", "q", "seconds"))]):
        with pytest.raises(EngineCrashed, match=f"`{field}`|an answer that cannot be read from {sys.executable}"):
            ask(written(tmp_path, do, field, text), do)
    needed = {"prepare": ["run"], "run": ["q", "w"], "time": ["seconds"], "hello": ["protocol"]}[do]
    if field in needed:
        with pytest.raises(EngineCrashed, match=f"no `{field}`|should speak version 1"):
            ask(written(tmp_path, do, field, None), do)
    else:
        ask(written(tmp_path, do, field, None), do)


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
            _check_description({"card": {field: value}} if inside else {field: value})
    command = written(tmp_path, "hello", "engine", json.dumps({"card": {field: values[0]}} if inside else {field: values[0]}))
    with pytest.raises(UnusableProgram, match=f"wrong, a program of .*`{field}`"):
        program_class(Program("wrong", tmp_path / "conservative.toml", " ".join(command)))
