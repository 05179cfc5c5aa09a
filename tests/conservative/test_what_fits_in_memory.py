"""The number that a message about memory names is the smallest one that fits."""

import pytest

import conservative as cv
from conservative.check import most_samples, require_memory


@pytest.mark.parametrize("rest", [0, 1, 3])
def test_what_is_said_to_fit_fits_and_nothing_less_does(rest):
    n_steps = 10 * (most_samples() - 1) + rest
    least = 10 if rest == 0 else 11
    require_memory("sample_every", n_steps, least)
    with pytest.raises(cv.BadInput) as caught:
        require_memory("sample_every", n_steps, least - 1)
    assert caught.value.allowed.startswith(f"{least} or more")
