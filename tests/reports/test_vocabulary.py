"""All commands crossed with the vocabulary of options: one name for one thing, in lists or repeated, and the old names work."""

import re
from contextlib import redirect_stderr
from io import StringIO

import click
import pytest
from click.testing import CliRunner

from conservative.errors import BadInput
from conservative.reports.cli.main import main
from conservative.reports.cli.options import EXIT_CODES, VOCABULARY, Command, Picture, split_names
from conservative.reports.document import PICTURES


def leaves(group, before=""):
    """Return all commands by their names, those of groups among them."""
    found = {}
    for name, command in group.commands.items():
        found |= leaves(command, f"{name} ") if isinstance(command, click.Group) else {before + name: command}
    return found


COMMANDS = leaves(main)
GIVEN = {"spread": "attitude=5deg", "body": "brick_flip", "out": "somewhere"}
"""Values of options that are required."""
LISTS = {"methods": ("gauss:stages=2,tol=1e-9", "mujoco:RK4"), "engines": ("mujoco", "exudyn@1.9"), "scenes": ("a:b=1", "c")}
VALUES = {"t_end": "3.5", "dt": "0.25", "error": "1e-4", "out": "place", "picture": "picture.svg"} | LISTS
OPTIONS = [(name, param) for name, command in COMMANDS.items() for param in command.params if isinstance(param, click.Option)]
CELLS = [(name, option) for name, option in OPTIONS if option.name in VOCABULARY]
cells = pytest.mark.parametrize(("name", "option"), CELLS, ids=[f"{name} {option.opts[0]}" for name, option in CELLS])


def parse(name, *arguments):
    """Return the parameters of a command from its arguments, with those that are required, and what it writes to stderr."""
    command = COMMANDS[name]
    required = [param for param in command.params if param.required and not {*param.opts} & {*arguments}]
    options = [text for each in required if isinstance(each, click.Option) for text in (each.opts[0], GIVEN[each.name])]
    words = ["somewhere" for each in required if isinstance(each, click.Argument)]
    said = StringIO()
    with redirect_stderr(said):
        return command.make_context(name, [*options, *arguments, *words]).params, said.getvalue()


@cells
def test_an_option_has_the_names_of_the_vocabulary(name, option):
    assert isinstance(COMMANDS[name], Command)
    assert tuple(sorted(option.opts)) == tuple(sorted(VOCABULARY[option.name][0]))
    assert option.multiple is (option.name in LISTS)
    assert isinstance(option.type, Picture) is (option.name == "picture")
    assert (option.type.name == "float") is (option.name in ("t_end", "dt", "error"))


@pytest.mark.parametrize("name", COMMANDS)
def test_no_option_has_another_name_for_a_word_of_the_vocabulary(name):
    old = {each for _, names in VOCABULARY.values() for each in names}
    for option in COMMANDS[name].params:
        assert not {*option.opts} & old
        assert option.name in VOCABULARY or not {*option.opts} & {each for names, _ in VOCABULARY.values() for each in names}


@cells
def test_every_name_means_the_same_and_old_ones_say_so(name, option):
    value = VALUES[option.name]
    value = ",".join(value) if option.name in LISTS else value
    names, old = VOCABULARY[option.name]
    expected = None
    for word in (*names, *old):
        for arguments in ([word, value], [f"{word}={value}"]) if word.startswith("--") else ([word, value],):
            found, said = parse(name, *arguments)
            expected = expected or found
            assert found == expected
            assert (f"{word} is now {names[0]};" in said) is (word in old)
            assert bool(said) is (word in old)


@pytest.mark.parametrize(("name", "option"), [cell for cell in CELLS if cell[1].name in LISTS])
def test_a_list_and_a_repeated_option_are_the_same(name, option):
    values, word = LISTS[option.name], option.opts[0]
    together, apart = (
        split_names(option.name, parse(name, *arguments)[0][option.name])
        for arguments in ([word, ",".join(values)], [text for value in values for text in (word, value)])
    )
    assert together == apart == list(values)


@pytest.mark.parametrize("name", [name for name, option in CELLS if option.name == "picture"])
def test_a_picture_is_svg_or_png(name):
    for ending in PICTURES:
        assert parse(name, "--picture", f"a{ending}")[0]["picture"].suffix == ending
    with pytest.raises(BadInput, match=r"picture: got 'a\.jpg'"):
        parse(name, "--picture", "a.jpg")


def test_a_word_after_two_dashes_is_no_option(capsys):
    assert parse("gate", "--", "--method")[0]["results"][0].name == "--method"
    assert capsys.readouterr().err == ""


FAILING = {
    *("run", "watch", "sweep", "report", "study", "gate", "track", "verify", "engines install"),
}
"""Commands that can end with exit code 1."""


@pytest.mark.parametrize("name", COMMANDS)
def test_a_help_page_lists_its_own_exit_codes(name):
    page = CliRunner(env={"COLUMNS": "110"}).invoke(main, [*name.split(), "--help"]).stdout.partition("Exit codes:\n")[2]
    own = {code for code, names in ((1, FAILING), (3, {"verify"})) if name in names}
    assert {int(code) for code in re.findall(r"^ +(\d+) ", page, re.MULTILINE)} == {*EXIT_CODES} | own
    assert ("--resume" in page) is any(option.name == "resume" for option in COMMANDS[name].params)


def test_the_vocabulary_is_used():
    """A word that no command has, or a cell that the tests above miss, is a mistake of the table."""
    assert {option.name for _, option in CELLS} == set(VOCABULARY)
    assert {old for _, olds in VOCABULARY.values() for old in olds} == {"--method", "--engine", "--duration"}  # of 0.3
    assert {"run --methods", "watch --error", "recommend --t-end", "verify --picture"} <= {
        f"{name} {VOCABULARY[option.name][0][0]}" for name, option in CELLS
    }
