"""Findings on engines: in checkpoints of reports, and between versions."""

import json
import math

import pytest

from conservative import registry
from conservative.benchmarks.studies.selection import Missing
from conservative.benchmarks.verification.finding import Cause, Finding, Verdict
from conservative.errors import MissingEngine
from conservative.reports.run.verification import Verified, from_plain, to_plain, verify_methods
from conservative.reports.sections.verified_engines import changes

CAUSE = Cause(("damping",), "The rates are damped", 1e-9, 0.2, {"damping": 0.1})
FINDINGS = (
    Finding("a", "motions", "fast", Verdict.WRONG, 0.2, 0.1, causes=(CAUSE,)),
    Finding("a", "motions", "slow", Verdict.NOT_TESTED, detail="why"),
    Finding("a", "pairs", "body: q and -q", Verdict.RIGHT, 0.0, 1e-12),
)
NAMES = {"family": "a", "engine": "a", "version": "1", "setting": "RK4"}


def test_findings_come_back_from_a_checkpoint():
    (found,) = from_plain(json.loads(json.dumps(to_plain([Verified(NAMES, FINDINGS)]))))
    assert found.names == NAMES
    assert repr(found.findings) == repr(FINDINGS).replace("mappingproxy({'damping': 0.1})", "{'damping': 0.1}")
    assert math.isnan(found.findings[1].error)
    assert found.findings[0].causes[0].key == "damping"
    with pytest.raises((KeyError, TypeError, ValueError)):
        from_plain([{"names": NAMES, "findings": [{"subject": "a"}]}])


def test_methods_of_a_report_are_verified_and_a_missing_one_is_not_tested():
    missing = Missing("exudyn", error=MissingEngine("exudyn", "exudyn"))
    methods = (registry.method("reduced"), missing)
    right, absent = verify_methods(methods, lambda share, what: None, checks=["repeatability"])
    assert {finding.verdict for finding in right.findings} == {Verdict.RIGHT}
    assert [finding.verdict for finding in absent.findings] == [Verdict.NOT_TESTED]
    assert "exudyn" in absent.findings[0].detail


def test_what_became_right_or_wrong_between_versions_is_a_sentence():
    mended = Finding("a", "motions", "fast", Verdict.RIGHT, 0.01, 0.1), FINDINGS[1], FINDINGS[2]
    versions = [(str(i), [Verified(NAMES, each)]) for i, each in enumerate((FINDINGS, FINDINGS, mended, FINDINGS))]
    better, worse = changes(versions)
    assert better == "RK4: motions, fast, 1 → 2: right"
    assert worse.startswith("RK4: motions, fast, 2 → 3: wrong: The rates are damped (leaves 1.0e-9 of 0.2 rad)")
