"""The mutation run: its table, its sample, and that a fault is killed where one that does nothing survives."""

from pathlib import Path

import pytest

from conservative.benchmarks.verification.mutation import mutants, table
from conservative.benchmarks.verification.mutation.__main__ import ROOT, describe, noticeable, share
from conservative.benchmarks.verification.mutation.judges import Verdict, start_judges
from conservative.benchmarks.verification.mutation.mutants import Mutant
from conservative.errors import BadInput

MODULE = "def double(x: int) -> int:\n    return 2 * x\n"
TEST = "from module import double\n\n\ndef test_double():\n    assert double(3) == 6\n"
SKIPPED = MODULE + "\n\nimport pytest\n\npytest.skip('no test runs', allow_module_level=True)\n"
ENDLESS = "def double(x: int) -> int:\n    while True:\n        pass\n"


def test_the_table_names_files_that_exist():
    for room in table.read_rooms().values():
        files = room.list_files(ROOT)
        assert files
        for file in files:
            paths = [argument.partition("::")[0] for argument in room.tests_of(file) if argument.startswith("tests/")]
            assert paths
            for path in paths:
                assert (ROOT / path).is_file(), f"{file}: {path}"
        assert set(room.tests) <= {Path(file).stem for file in files} | {"all"}


def test_known_survivors_are_lines_of_their_files_and_have_a_reason():
    for file, before, after in table.list_equivalents():
        lines = [line.strip() for line in (ROOT / file).read_text(encoding="utf-8").splitlines()]
        assert before in lines, f"{file}: {before}"
        assert before != after
        assert table.find_reason(Mutant(file, 1, before, after, ""))
    assert not table.find_reason(Mutant("nothing.py", 1, "a", "b", ""))


def test_rooms_and_files_are_found_by_name():
    everything = table.choose_rooms([], ROOT)
    assert [room.name for room, _ in everything] == list(table.read_rooms())
    ((room, files),) = table.choose_rooms(["conservative/kernels/lame.py"], ROOT)
    assert (room.name, files) == ("kernels", ["conservative/kernels/lame.py"])
    with pytest.raises(BadInput, match="kernel"):
        table.choose_rooms(["kernel"], ROOT)


def test_the_share_and_its_interval():
    mutant = Mutant("a.py", 1, "a", "b", "")
    found = share([Verdict(mutant, 1)] * 9 + [Verdict(mutant, 0)])
    assert found == pytest.approx((0.9, 0.5958, 0.9821), abs=1e-4)  # Wilson's interval of 9 of 10
    assert share([Verdict(mutant, None)])[0] == 1.0


def test_survivors_that_are_listed_are_counted_apart():
    listed, real = Mutant(*(file := table.list_equivalents()[0])[:1], 1, *file[1:], ""), Mutant("a.py", 1, "a", "b", "")
    verdicts = [*[Verdict(real, 1)] * 8, Verdict(real, 0), Verdict(listed, 0), Verdict(listed, 1)]
    assert describe(verdicts).startswith("killed 9 of 11: 81.8% (95 %: ")
    assert describe(noticeable(verdicts)).startswith("killed 9 of 10: 90.0% (95 %: 59.6% to 98.2%)")


@pytest.mark.skipif(not hasattr(__import__("os"), "fork"), reason="mutants are judged by forks")
def test_a_fault_is_killed_and_one_that_does_nothing_survives(tmp_path):
    for name, text in {"module.py": MODULE, "test_module.py": TEST, "pytest.ini": "[pytest]\n"}.items():
        (tmp_path / name).write_text(text)
    texts = {"fault": MODULE.replace("2 * x", "3 * x"), "nothing": MODULE.replace("2 * x", "x * 2"), "skip": SKIPPED}
    tried = [(Mutant("module.py", 2, "", name, text), ["test_module.py"]) for name, text in texts.items()]
    with start_judges(tmp_path, 1) as judges:
        verdicts = {verdict.mutant.after: verdict for verdict in judges.judge_all(tmp_path, tried)}
        late = judges.judge("module.py", ENDLESS, ["test_module.py"], 3.0)["code"]
    assert {name: each.survived for name, each in verdicts.items()} == {"fault": False, "nothing": True, "skip": False}
    assert not any(each.late for each in verdicts.values())
    assert Verdict(tried[0][0], late).late
    assert (tmp_path / "module.py").read_text() == MODULE


def test_tests_that_fail_without_a_mutant_are_an_error(tmp_path):
    (tmp_path / "module.py").write_text(MODULE)
    (tmp_path / "test_module.py").write_text(TEST.replace("6", "7"))
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    with start_judges(tmp_path, 1) as judges, pytest.raises(RuntimeError, match="fails without a mutant"):
        list(judges.judge_all(tmp_path, [(Mutant("module.py", 2, "", "", MODULE), ["test_module.py"])]))


def test_mutants_are_drawn_by_the_seed_and_none_is_of_what_does_nothing(tmp_path):
    pytest.importorskip("cosmic_ray", reason="no extra installs it")
    (tmp_path / "module.py").write_text('"""Two."""\n\nX: int | None = 3\n' + MODULE)
    drawn = [mutants.draw_mutants(tmp_path, ["module.py"], 9, seed) for seed in (1, 1, 2)]
    assert drawn[0] == drawn[1]
    assert {mutant.before for mutant in drawn[0][0]} <= {"X: int | None = 3", "return 2 * x"}
    assert {mutant.after for mutant in drawn[0][0]}.isdisjoint({"X: int + None = 3"})


def test_without_the_tool_the_command_says_what_to_install(monkeypatch):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(mutants, "import_module", missing)
    with pytest.raises(BadInput, match="pip install cosmic-ray"):
        mutants.list_places(MODULE)
