"""Files of known errors: every kind of finding is recorded, known in a run that is the same, and new if it is worse."""

import math
import shlex
import sys
from dataclasses import replace
from io import StringIO

import pytest

from conservative.benchmarks.verification import known, programs
from conservative.benchmarks.verification.finding import (
    CHECKS,
    Cause,
    Finding,
    MotionFinding,
    Settings,
    Standing,
    Verdict,
    Verification,
)
from conservative.benchmarks.verification.motions.motion import load
from conservative.benchmarks.verification.pairs.verify import PairFinding
from conservative.benchmarks.verification.verify import verify
from conservative.errors import BadInput
from conservative.references.worker.client import close_workers

from . import right_programs, wrong_programs

RIGHT, WRONG, UNDECIDED, NOT_TESTED = Verdict
NAN, INF = math.nan, math.inf
GYRO, DAMPING = Cause(("no gyroscopic term",), "The term is missing"), Cause(("damping", "sleep"), "Damped and asleep")
SETTINGS = Settings(2, 0.01, "double")


def motion(verdict=WRONG, errors=(0.2, 0.3), causes=(GYRO,), case="separatrix", tolerances=(0.01, 0.02), detail=""):
    worst = errors[0], tolerances[0]
    return MotionFinding(
        "a", "motions", case, verdict, *worst, causes=causes, detail=detail, errors=errors, tolerances=tolerances
    )


FINDINGS = {
    "motion": motion(),
    "motion without a mistake": motion(causes=()),
    "motion with two mistakes": motion(causes=(GYRO, DAMPING)),
    "motion that ended early": motion(errors=(INF, INF), causes=(), detail="the run ended early: crashed"),
    "motion beside one that ended early": motion(errors=(0.2, 0.3)),
    "right motion": motion(RIGHT, (0.001, 0.002), ()),
    "motion that is right by its order": motion(RIGHT, (0.02, 0.03), (), detail="100 % above the tolerance, falls as h^2.00"),
    "unsupported motion": Finding("a", "motions", "rotor", NOT_TESTED, detail="it has no rotors"),
    "order": Finding("a", "order", "", WRONG, 1.02, 2.0, "", "declared"),
    "order that was not measured": Finding("a", "order", "", NOT_TESTED),
    "pair": PairFinding("a", "pairs", "body: time x 2^k", WRONG, 0.12, 1e-9, by="rounding"),
    "pair with the same bits": PairFinding("a", "pairs", "body: run again", WRONG, 1e-16, NAN, by="bits"),
    "pair that crashes": PairFinding("a", "pairs", "top: mass x 2^k", WRONG, INF, 1e-9),
    "pair that is right by its limit": PairFinding("a", "pairs", "top: mirrored", RIGHT, 0.1, 1e-9),
    "undecided pair": PairFinding("a", "pairs", "top, heavy: mirrored", UNDECIDED, 0.1, 1e-9),
    "parity": Finding("a and b", "parity", "brick_flip", WRONG, 0.12, 1e-4),
    "repeatability": Finding("a", "repeatability", "golden_0", WRONG, by="bits", detail="a second run has other samples"),
    "right repeatability": Finding("a", "repeatability", "golden_0", RIGHT, by="bits"),
    "protocol": Finding("a", "protocol", "hello", RIGHT, detail="C, version 1"),
    "times": Finding("a", "times", "", WRONG, detail="2 s for 4 runs, and 1 s with the exchange"),
    "recording": Finding("a", "recording", "", WRONG, 0.3, 1e-6, causes=(DAMPING,)),
    "undecided recording": Finding("a", "recording", "", UNDECIDED, 0.3, 1e-6, detail="too much noise"),
    "body": Finding("mujoco 3.6.0", "bodies", "a.urdf: link", WRONG, 0.3, 1e-4, "relative", causes=(GYRO,)),
    "link": Finding("a.urdf", "links", "arm", WRONG, 0.3, 0.05, "relative", causes=(Cause(("placeholder",), "A placeholder"),)),
    "refused body": Finding("drake 1.2", "bodies", "a.urdf: link", WRONG, detail="refused"),
}
"""A finding of each kind that a verification can have."""


def verification(*findings, subject="a", kind="program", settings=SETTINGS):
    return Verification(subject, kind, findings, settings=settings)


def record(*verifications):
    stream = StringIO()
    known.write(stream, known.blocks_of(verifications))
    return stream.getvalue()


def compared(was, now, tmp_path, **options):
    """Return verifications against the file of earlier ones."""
    file = tmp_path / "known.txt"
    file.write_text(record(*was), encoding="utf-8")
    return known.compare(now, known.read(file), **options)


def one(was, now, tmp_path, **options):
    return compared([verification(*was)], [verification(*now)], tmp_path, **options)[0]


def test_every_check_has_a_finding_here():
    assert {finding.check for finding in FINDINGS.values()} == set(CHECKS)


@pytest.mark.parametrize("name", FINDINGS)
def test_what_is_the_same_is_no_failure(name, tmp_path):
    others = (motion(RIGHT, (0.001, 0.002), (), case="golden_0"),)  # without one, a run that ends early is not recorded
    found = one((FINDINGS[name], *others), (FINDINGS[name], *others), tmp_path)
    assert (found.exit_code, found.change, found.new) == (0, "", [])
    verdict = FINDINGS[name].verdict
    assert found.findings[0].standing == (Standing.KNOWN if verdict in (WRONG, UNDECIDED) else None)
    assert found.verdict is verdict or verdict is NOT_TESTED


def worse(finding):
    """Return the finding with an error that is 5 % and its allowed error larger, or wrong if it was right."""
    if isinstance(finding, MotionFinding):
        errors = tuple(1.05 * error + most for error, most in zip(finding.errors, finding.tolerances, strict=True))
        return replace(finding, verdict=WRONG, error=errors[0], errors=errors)
    if finding.check == "order":
        return replace(finding, verdict=WRONG, error=finding.error - 0.3)
    allowed = 0 if math.isnan(finding.allowed) else finding.allowed
    return replace(finding, verdict=WRONG, error=1.05 * finding.error + allowed + 2e-9)


@pytest.mark.parametrize("name", [name for name, finding in FINDINGS.items() if not math.isinf(finding.error)])
def test_what_is_worse_is_a_new_failure(name, tmp_path):
    finding = FINDINGS[name]
    if finding.verdict is NOT_TESTED or (finding.verdict is WRONG and math.isnan(finding.error)):
        return  # nothing can be worse
    found = one((finding,), (worse(finding),), tmp_path)
    assert (found.exit_code, [each.standing for each in found.findings]) == (1, [Standing.NEW])
    assert "was" in found.findings[0].change


@pytest.mark.parametrize("name", [name for name, finding in FINDINGS.items() if finding.causes])
@pytest.mark.parametrize("cause", [(), (Cause(("rate limit",), "Limited"),)])
def test_another_mistake_is_a_new_failure(name, cause, tmp_path):
    found = one((FINDINGS[name],), (replace(FINDINGS[name], causes=cause),), tmp_path)
    assert found.exit_code == 1
    assert f"{cause[0].key if cause else known.UNKNOWN}, was " in found.findings[0].change


def test_one_of_several_mistakes_is_enough(tmp_path):
    both = FINDINGS["motion with two mistakes"]
    assert one((both,), (replace(both, causes=(DAMPING,)),), tmp_path).exit_code == 0
    assert one((replace(both, causes=(GYRO,)),), (both,), tmp_path).exit_code == 0


def test_three_digits_and_another_machine_change_nothing(tmp_path):
    """A recorded error has three digits; its tolerance can be much smaller than the last of them."""
    was = motion(errors=(2.3149, 0.3), tolerances=(1e-9, 1e-9))
    assert one((was,), (was,), tmp_path).exit_code == 0
    assert one((was,), (motion(errors=(2.32, 0.3), tolerances=(1e-9, 1e-9)),), tmp_path).exit_code == 0
    assert one((was,), (motion(errors=(2.35, 0.3), tolerances=(1e-9, 1e-9)),), tmp_path).exit_code == 1


def test_the_size_of_rounding_shows_nothing(tmp_path):
    bits = FINDINGS["pair with the same bits"]
    assert one((bits,), (replace(bits, error=5e-16),), tmp_path).exit_code == 0


def test_a_larger_error_within_the_tolerance_is_known(tmp_path):
    found = one((motion(),), (motion(errors=(0.209, 0.3)),), tmp_path)
    assert (found.exit_code, found.findings[0].standing) == (0, Standing.KNOWN)


@pytest.mark.parametrize("k", [0, 1])
def test_both_errors_of_a_motion_are_compared(k, tmp_path):
    errors = [0.2, 0.3]
    errors[k] += 0.1
    found = one((motion(),), (motion(errors=tuple(errors)),), tmp_path)
    names = ("attitude error 3.0e-01 rad, was 2.0e-01", "rates error 4.0e-01, was 3.0e-01")
    assert found.findings[0].change == f"{names[k]}; no gyroscopic term"


def test_what_is_better_is_said_and_is_no_failure(tmp_path):
    right = motion(RIGHT, (0.001, 0.002), ())
    for now, phrase in ((right, "2.0e-01 to 1.0e-03 rad"), (motion(errors=(0.1, 0.3)), "2.0e-01 to 1.0e-01 rad")):
        found = one((motion(),), (now,), tmp_path)
        assert (found.exit_code, found.findings[0].standing) == (0, Standing.BETTER)
        assert found.findings[0].change == f"{phrase}: record again to tighten"
    repeated = one((FINDINGS["repeatability"],), (FINDINGS["right repeatability"],), tmp_path)
    assert (repeated.exit_code, repeated.findings[0].standing) == (0, Standing.BETTER)


def test_a_smaller_error_with_another_mistake_is_no_failure(tmp_path):
    """A fix of the larger mistake shows the smaller one, which it has hidden."""
    fixed = motion(errors=(0.05, 0.06), causes=(Cause(("no products of inertia",), "Dropped"),))
    found = one((motion(),), (fixed,), tmp_path)
    assert (found.exit_code, found.findings[0].standing) == (0, Standing.BETTER)
    assert found.findings[0].change == "2.0e-01 to 5.0e-02 rad, now no products of inertia: record again to tighten"
    half_better = replace(fixed, error=0.3, errors=(0.3, 0.06))
    assert one((motion(),), (half_better,), tmp_path).exit_code == 1


def test_a_smaller_error_of_a_right_case_is_not_news(tmp_path):
    right = motion(RIGHT, (0.009, 0.002), (), tolerances=(0.01, 0.02))
    assert one((right,), (replace(right, errors=(1e-9, 0.002)),), tmp_path).findings[0].standing is None


@pytest.mark.parametrize("gone", ["unsupported", "missing"])
def test_what_is_not_tested_any_more_is_a_new_failure(gone, tmp_path):
    now = [replace(FINDINGS["unsupported motion"], case="separatrix")] if gone == "unsupported" else []
    found = one((motion(),), now, tmp_path)
    reason = f"it has no rotors; {known.SKIPPED}" if gone == "unsupported" else known.SKIPPED
    assert (found.exit_code, [each.change for each in found.new]) == (1, [reason])
    assert found.change.endswith(f"first bad motion: separatrix ({known.SKIPPED})")


def test_a_new_wrong_case_is_a_new_failure_and_a_new_right_one_is_none(tmp_path):
    assert one((), (motion(),), tmp_path).exit_code == 1
    assert one((), (motion(RIGHT, (0.001, 0.002), ()),), tmp_path).exit_code == 0
    assert one((), (FINDINGS["order"],), tmp_path).exit_code == 1


def test_a_new_undecided_case_keeps_its_exit_code(tmp_path):
    undecided = FINDINGS["undecided pair"]
    assert one((motion(),), (motion(), undecided), tmp_path).exit_code == 3
    assert one((undecided,), (undecided, replace(undecided, case="another")), tmp_path).exit_code == 3
    assert one((undecided,), (replace(undecided, verdict=WRONG),), tmp_path).exit_code == 1


def test_a_subject_that_cannot_be_tested_was_recorded_so(tmp_path):
    untested = FINDINGS["unsupported motion"]
    assert verification(untested).exit_code == 3
    assert one((untested,), (untested,), tmp_path).exit_code == 0


def test_checks_and_pairs_that_were_not_asked_for_are_not_missed(tmp_path):
    was = (motion(), FINDINGS["pair"], FINDINGS["pair that crashes"], FINDINGS["times"])
    assert one(was, (motion(),), tmp_path, only=("motions",)).exit_code == 0
    assert one(was, (motion(),), tmp_path, only=("motions", "times")).exit_code == 1
    assert one(was, (FINDINGS["pair"],), tmp_path, only=("pairs",), some_pairs=True).exit_code == 0
    assert one(was, (FINDINGS["pair"],), tmp_path, only=("pairs",)).exit_code == 1


def test_an_engine_that_is_not_deterministic_may_have_other_errors(tmp_path):
    other = motion(errors=(0.35, 0.3), causes=())
    assert one((motion(), FINDINGS["repeatability"]), (other, FINDINGS["repeatability"]), tmp_path).exit_code == 0
    right = FINDINGS["right repeatability"]
    assert one((motion(), right), (other, right), tmp_path).exit_code == 1
    far = motion(errors=(0.5, 0.3), causes=())
    assert one((motion(), FINDINGS["repeatability"]), (far, FINDINGS["repeatability"]), tmp_path).exit_code == 1


def test_a_program_that_does_not_run_has_no_known_errors(tmp_path):
    silent = Finding("a", "protocol", "", WRONG, detail="timeout (after 30 s)")
    with pytest.raises(BadInput, match="does not answer"):
        record(verification(silent))
    with pytest.raises(BadInput, match="all end early"):
        record(verification(FINDINGS["motion that ended early"]))
    found = one((motion(), FINDINGS["pair"]), (silent,), tmp_path)
    assert (found.exit_code, [each.check for each in found.new]) == (1, ["protocol"])


def test_engines_have_a_block_for_each_setting_and_can_have_another_version(tmp_path):
    was = [
        verification(replace(motion(), subject=name), subject=name, kind="engine")
        for name in ("mujoco@3.12.0", "mujoco@3.12.0:RK4")
    ]
    now = [
        verification(replace(motion(), subject=name), subject=name, kind="engine") for name in ("mujoco@4.0:RK4", "mujoco@4.0")
    ]
    assert [each.exit_code for each in compared(was, now, tmp_path)] == [0, 0]
    for kind, others in (("program", now), ("engine", [replace(each, subject="drake") for each in now[:1]])):
        with pytest.raises(BadInput, match="no subject"):
            compared(was, [replace(each, kind=kind) for each in others], tmp_path)
    with pytest.raises(BadInput, match="line 5, which is not verified"):
        compared(was, now[1:], tmp_path)


def test_settings_that_differ_are_refused_with_both_values(tmp_path):
    now = verification(motion(), settings=Settings(None, 0.01, "single"))
    with pytest.raises(BadInput, match=r"settings 2,0.01,double of 'a' \(line 2\).*adaptive,0.01,single: record again"):
        compared([verification(motion())], [now], tmp_path)


def test_subjects_and_cases_need_different_names():
    with pytest.raises(BadInput, match="2 subjects of the name 'a'"):
        record(verification(motion()), verification(motion()))
    with pytest.raises(BadInput, match="a name in one line"):
        record(verification(motion(), motion()))
    with pytest.raises(BadInput, match="a name in one line"):
        record(verification(motion(case="two\nlines")))


def test_a_file_is_written_as_it_is_read(tmp_path):
    file, names = tmp_path / "known.txt", ('python "my engine.py" -x 1,2', "b")
    rest = [finding for name, finding in FINDINGS.items() if "motion" not in name or name == "motion"]
    rest = [finding for finding in rest if finding not in (FINDINGS["right repeatability"], FINDINGS["undecided recording"])]
    made = [
        verification(*(replace(one, subject=name) if one.subject == "a" else one for one in rest), subject=name)
        for name in names
    ]
    blocks = known.blocks_of(made)
    file.write_text(record(*made), encoding="utf-8")
    again = known.read(file)
    assert [block.subject for block in again] == list(names)
    for block, back in zip(blocks, again, strict=True):
        assert (block.settings, list(block.cases)) == (back.settings, list(back.cases))
        assert back.order == pytest.approx(block.order, rel=1e-2)
        for key, case in block.cases.items():
            assert back.cases[key].mistakes == case.mistakes
            assert back.cases[key].errors == pytest.approx(case.errors, rel=5e-3, nan_ok=True)
    lines = file.read_text(encoding="utf-8").splitlines()
    assert lines[0] == known.HEAD
    assert "motions,separatrix,0.200,0.300,no gyroscopic term" in lines
    assert "pairs,body: time x 2^k,0.120,," in lines


GOOD = ("subject,a", "settings,2,0.01,double", "order,2.00", "motions,slow,1.20e-05,3.40e-06,")
BAD = {
    "motions,slow,1,2": "five values",
    "motions,fast,x,2,": "a number of 0 or more instead of 'x'",
    "motions,fast,nan,2,": "a number of 0 or more instead of 'nan'",
    "motions,fast,-1,2,": "a number of 0 or more instead of '-1'",
    "motions,slow,1,2,": "the first one is line 4",
    "settings,2,0.01": "settings,ORDER,ANGLE,PRECISION",
    "settings,2,0.01,half": "settings,ORDER,ANGLE,PRECISION",
    "order,1,2": "order,NUMBER",
    "subject,a": "once for each subject",
    "movements,slow,1,2,": "a line that begins with subject",
    '"motions,slow': "values between commas",
}


@pytest.mark.parametrize("line", BAD)
def test_a_bad_line_is_named_with_its_number(line, tmp_path):
    file = tmp_path / "known.txt"
    file.write_text("\n".join((*GOOD, line, "")), encoding="utf-8")
    with pytest.raises(BadInput) as refused:
        known.read(file)
    assert "in line 5 of" in str(refused.value)
    assert BAD[line] in str(refused.value)


@pytest.mark.parametrize("content", [None, b"", b"# nothing\n", b"\xff\xfe", b"motions,slow,1,2,\n", b"\x00" * 20])
def test_a_file_that_is_none_is_refused(content, tmp_path):
    file = tmp_path / "known.txt"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(BadInput, match="known: got"):
        known.read(file)


def change(was, now, tmp_path):
    return one(was, now, tmp_path).change


def test_the_sentence_has_what_changed(tmp_path):
    """Free motions only: `rotor` is not free, and a run that ended early has no error."""
    good, order = motion(RIGHT, (0.001, 0.002), (), case="golden_0"), Finding("a", "order", "", RIGHT, 2.0, 2.0)
    rotor = motion(errors=(0.5, 0.5), causes=(), case="rotor")
    was = (good, motion(errors=(0.19, 0.1)), rotor, order)
    now = (
        replace(good, verdict=WRONG, errors=(0.02, 0.1), causes=(GYRO,)),
        motion(errors=(0.23, 0.1)),
        rotor,
        replace(order, verdict=WRONG, error=1.0),
    )
    start = "free rotation at your step: "
    errors, orders, first = (
        "attitude error 0.19 to 0.23 rad",
        "order 2.0 to 1.0",
        "first bad motion: golden_0 (no gyroscopic term)",
    )
    assert change(was, now, tmp_path) == f"{start}{errors}, {orders}; {first}"
    assert change(was, (*was[:3], now[3]), tmp_path) == f"{start}{orders}"
    assert change(was, (now[0], *was[1:]), tmp_path) == f"{start}{first}"
    assert change(was, (was[0], motion(errors=(0.196, 0.1)), *was[2:]), tmp_path) == f"{start}attitude error 0.19 to 0.2 rad"
    ended = motion(errors=(INF, INF), causes=(), detail="the run ended early: crashed")
    assert change(was, (was[0], ended, *was[2:]), tmp_path).endswith("separatrix (the run ended early: crashed)")
    several = compared(
        [verification(*was), verification(subject="b")], [verification(*now), verification(subject="b")], tmp_path
    )
    assert [each.change for each in several] == [f"free rotation at your step (a): {errors}, {orders}; {first}", ""]


def test_without_a_change_there_is_no_sentence(tmp_path):
    """Neither of the same run, nor of a pair that is new, a rotor that is worse, or an order that was not measured."""
    order = Finding("a", "order", "", RIGHT, 2.0, 2.0)
    was = (motion(errors=(0.1901, 0.1)), order)
    assert change(was, was, tmp_path) == ""
    assert change(was, (motion(errors=(0.1904, 0.1)), replace(order, error=1.9)), tmp_path) == ""
    assert change(was, (*was, FINDINGS["pair"]), tmp_path) == ""
    edge = motion(errors=(3.0496, 0.1))  # 3.05 in the file, which is 3.0 or 3.1 in two digits
    assert change((edge,), (edge,), tmp_path) == ""
    assert change((edge,), (motion(errors=(3.051, 0.1)),), tmp_path) == ""
    assert change(was, (was[0], replace(order, verdict=NOT_TESTED, error=NAN)), tmp_path) == ""
    assert (
        change((motion(RIGHT, (0.001, 0.001), (), case="rotor"),), (motion(RIGHT, (0.009, 0.001), (), case="rotor"),), tmp_path)
        == ""
    )


FEW = ("golden_0", "golden_9", "products", "world_tensor", "half_turn", "separatrix", "slow")
PROGRAMS = {
    "damping": (wrong_programs, "damping 0.1"),
    "no gyroscopic term": (wrong_programs, "no gyroscopic term"),
    "explicit Euler": (wrong_programs, "explicit Euler"),
    "float": (right_programs, "midpoint, quaternion, world momentum, single"),
}


@pytest.fixture
def few_motions(monkeypatch, tmp_path):
    few = [one for one in load() if one.name in FEW]
    monkeypatch.setattr(programs, "load", lambda: few)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    yield
    close_workers()


def command(name):
    module, argument = PROGRAMS[name]
    return shlex.join([sys.executable, module.__file__, argument])


@pytest.mark.usefixtures("few_motions")
@pytest.mark.parametrize("name", PROGRAMS)
def test_the_first_run_of_a_program_passes_and_so_do_later_ones(name, tmp_path):
    file, checks = tmp_path / "known.txt", ("protocol", "motions", "order", "repeatability")
    (first,) = verify(command(name), record=file, only=checks)
    text = file.read_text(encoding="utf-8")
    (again,) = verify(command(name), known=file, only=checks)
    (plain,) = verify(command(name), only=checks)
    assert [each.exit_code for each in (first, again, plain)] == [0, 0, 0 if name == "float" else 1]
    assert [len(each.known) for each in (first, again)] == [sum(f.verdict is WRONG for f in plain.findings)] * 2
    assert (first.change, again.change, file.read_text(encoding="utf-8")) == ("", "", text)


@pytest.mark.usefixtures("few_motions")
def test_a_program_that_becomes_wrong_fails_with_a_sentence(tmp_path):
    """The program is another file of the same name, as in a pull request. Measured: 0.098 to 0.24 rad."""
    program, file = tmp_path / "engine.py", tmp_path / "known.txt"
    text = f"#!{sys.executable}\nimport sys\nsys.path.insert(0, {str(right_programs.__file__.rpartition('/')[0])!r})\n"
    text += "from wrong_programs import serve, wrong_programs\nserve(wrong_programs()[{name!r}], 'engine')\n"
    program.write_text(text.format(name="damping 0.1"), encoding="utf-8")
    program.chmod(0o755)
    verify(program, record=file, only=["motions"])
    close_workers()
    program.write_text(text.format(name="no gyroscopic term"), encoding="utf-8")
    (found,) = verify(program, known=file, only=["motions"])
    assert (found.exit_code, found.new[0].causes[0].key) == (1, "no gyroscopic term")
    assert "no gyroscopic term, was damping" in found.new[0].change
    assert found.change.startswith("free rotation at your step: attitude error ")
    # In golden_0, the error is smaller than with damping: another mistake is no failure there.
    assert found.change.endswith("first bad motion: golden_9 (no gyroscopic term)")


def test_a_file_of_others_and_the_recording_itself_are_not_replaced(tmp_path):
    for content in ("t,w_x\n", "subject,a\n", f"x{known.HEAD}\n"):
        (tmp_path / "run.csv").write_text(content, encoding="utf-8")
        with pytest.raises(BadInput, match="not a file of known errors"):
            verify("taylor", record=tmp_path / "run.csv", only="repeatability")
        assert (tmp_path / "run.csv").read_text(encoding="utf-8") == content


def test_recording_and_comparing_at_once_is_refused(tmp_path):
    with pytest.raises(BadInput, match="one of them"):
        verify("taylor", record=tmp_path / "a", known=tmp_path / "b")
    assert not list(tmp_path.iterdir())


def test_nothing_is_written_if_the_run_fails(tmp_path, monkeypatch):
    module = sys.modules[verify.__module__]
    (tmp_path / "known.txt").write_text(f"{known.HEAD}\nsubject,a\n", encoding="utf-8")
    monkeypatch.setattr(module, "_verify_all", lambda *_: [verification(Finding("a", "protocol", "", WRONG, detail="silent"))])
    with pytest.raises(BadInput, match="does not answer"):
        verify("taylor", record=tmp_path / "known.txt")
    assert (tmp_path / "known.txt").read_text(encoding="utf-8") == f"{known.HEAD}\nsubject,a\n"
    assert [path.name for path in tmp_path.iterdir()] == ["known.txt"]
