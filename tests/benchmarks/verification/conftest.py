"""A fixture of the tests of verification."""

import pytest

from conservative.benchmarks.verification.explain import Diagnosis
from conservative.benchmarks.verification.recordings import verdict

from ...shared_reader import reading_worker, shared_reader  # noqa: F401


@pytest.fixture
def unnamed(monkeypatch):
    """No mistake is searched for, which takes most of the work: verdicts follow from the errors alone."""
    monkeypatch.setattr(verdict, "diagnose", lambda *_: Diagnosis())
