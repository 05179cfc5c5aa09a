"""Fixtures of the tests of verification."""

import math
from types import SimpleNamespace

import pytest

from conservative.benchmarks.verification.explain import Diagnosis
from conservative.benchmarks.verification.recordings import verdict

from ...shared_reader import reading_worker, shared_reader  # noqa: F401


@pytest.fixture
def unnamed(monkeypatch):
    """No mistake is searched for, which takes most of the work: verdicts follow from the errors alone."""
    monkeypatch.setattr(verdict, "diagnose", lambda *_: Diagnosis())


@pytest.fixture
def no_moments(monkeypatch):
    """No ratios of moments are fitted to right recordings with noise, which changes no verdict."""
    monkeypatch.setattr(verdict, "fit_moments", lambda case: SimpleNamespace(left=(math.inf, math.inf), sentence=""))
