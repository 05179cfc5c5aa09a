"""The table of planted faults fits the sources of today, and its command tells a fault that is seen from one that is not."""

import pytest

from conservative.benchmarks.verification import planted_faults
from conservative.benchmarks.verification.planted_faults import Fault, Verdict, find_checkout, occurrences, read_faults

CHECKOUT = find_checkout()
FAULTS = read_faults()
LINE, TEST = "benchmarks/measures/line.py", ("tests/benchmarks/test_line.py",)

needs_checkout = pytest.mark.skipif(CHECKOUT is None, reason="faults are planted into a checkout")


@needs_checkout
def test_each_text_is_in_its_file_exactly_once():
    found = {f"{fault.file}: {fault.old}": occurrences(CHECKOUT, fault) for fault in FAULTS}
    assert {text: count for text, count in found.items() if count != 1} == {}


@needs_checkout
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: f"{fault.file}-{fault.why}")
def test_each_fault_changes_something_and_names_tests_that_are_there(fault):
    assert fault.old != fault.new
    assert fault.why
    assert fault.tests
    for test in fault.tests:
        path, _, name = test.partition("::")
        assert f"def {name.partition('[')[0]}" in (CHECKOUT / path).read_text(encoding="utf-8")


@needs_checkout
def test_a_fault_is_caught_and_a_harmless_change_survives(capsys):
    faults = {
        1: Fault(LINE, "float(found.slope), scatter", "-float(found.slope), scatter", TEST, "the wrong sign"),
        2: Fault(LINE, '"""Return the line through', '"""Return a line through', TEST, "another word"),
        3: Fault(LINE, "no such text", "", TEST, "nothing to replace"),
        4: Fault(LINE, "x.mean()", "", TEST, "more than one"),
        5: Fault(LINE, '"""Return the line through', "", ("tests/benchmarks/test_line.py::no_such_test",), "no test"),
    }
    assert planted_faults.plant(CHECKOUT, faults, jobs=1) == 1
    *lines, last = capsys.readouterr().out.splitlines()
    found = [Verdict(line[5:27].strip()) for line in lines]
    assert found == [Verdict.CAUGHT, Verdict.SURVIVED, Verdict.ABSENT, Verdict.ABSENT, Verdict.UNFIT]
    assert last == "5 faults: 1 caught, 1 SURVIVED, 2 text not found, 1 tests fail without it"
    assert all(occurrences(CHECKOUT, faults[number]) == 1 for number in (1, 2))


def test_without_a_checkout_it_says_so(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(planted_faults, "__file__", str(tmp_path / "benchmarks" / "verification" / "planted_faults.py"))
    with pytest.raises(SystemExit) as ended:
        planted_faults.main([])
    assert ended.value.code == 2
    assert "into a checkout" in capsys.readouterr().err


def test_a_number_that_is_not_in_the_table_is_refused(capsys):
    with pytest.raises(SystemExit) as ended:
        planted_faults.main(["--only", "1,100000"])
    assert ended.value.code == 2
    assert "no fault 100000" in capsys.readouterr().err
