"""The names of engines in environments: read back, and refused with the nearest."""

import pickle

import pytest

import conservative as cv
from conservative import registry
from conservative.errors import MissingEngine

pytestmark = pytest.mark.usefixtures("trial_cache", "trial_registered")


def test_a_name_with_a_version_is_read_back():
    for text in ("trial", "trial:segfault", "trial@1.0", "trial@1.0:do=print,at=prepare"):
        method = registry.method(text)
        assert registry.method(method.name) == method
        assert pickle.loads(pickle.dumps(method)) == method
    assert registry.method("trial@1.0").label == "trial==1.0/integrate"


def test_a_version_that_is_not_installed_is_missing():
    with pytest.raises(MissingEngine, match=r"'trial==2.0'.*installed are 1.0.*conservative engines install trial==2.0"):
        registry.method("trial@2.0")


def test_an_unknown_name_names_the_nearest():
    with pytest.raises(cv.BadInput, match="'trial' \\(nearest\\)"):
        registry.method("trail:segfault")
    with pytest.raises(cv.BadInput, match="with @ and a version"):
        registry.method("reduced@1.0")
