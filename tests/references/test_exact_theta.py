import mpmath
import numpy as np
import pytest

from conservative.errors import BadInput
from conservative.references.exact.clock import Clock, rotation_clock
from conservative.references.exact.digits import mp
from conservative.references.exact.theta import Lattice, Points, jacobi

# From the sphere's parameter to the separatrix's, and next to both.
PARAMETERS = ["0", "1e-30", "0.3", "0.4999", "0.5001", "0.97"]
COMPLEMENTS = ["1e-9", "1e-30", "1e-200"]


def lattices():
    for m in map(mp.mpf, PARAMETERS):
        yield Lattice.of(m, 1 - m)
    for mc in map(mp.mpf, COMPLEMENTS):
        yield Lattice.of(1 - mc, mc)


@pytest.mark.parametrize("lattice", list(lattices()), ids=[*PARAMETERS, *(f"1-{mc}" for mc in COMPLEMENTS)])
def test_jacobi_functions_satisfy_their_equations_in_many_digits(lattice):
    # sn' = cn dn, cn' = -sn dn and sn^2 + cn^2 = 1 determine the three, given dn: nothing here is taken from another library
    sn, cn, dn = jacobi(lattice)
    for v in (mp.mpf("-0.7"), mp.mpf("0.2"), mp.mpf("1.5")):
        (s, s_slope), (c, c_slope), (d, _) = (f.value_and_slope(v) for f in (sn, cn, dn))
        assert abs(s_slope - c * d) < 1e-140
        assert abs(c_slope + s * d) < 1e-140
        assert abs(s**2 + c**2 - 1) < 1e-140


@pytest.mark.parametrize("m", [0.0, 0.3, 0.4999, 0.5001, 0.97, 1 - 1e-9])
def test_jacobi_functions_equal_those_of_mpmath(m):
    lattice = Lattice.of(mp.mpf(m), 1 - mp.mpf(m))
    v = np.linspace(-1, 1, 41) * float(lattice.K)
    points = Points(lattice, v)
    with mpmath.workdps(40):
        for name, function in zip(("sn", "cn", "dn"), jacobi(lattice), strict=True):
            known = np.array([float(mpmath.ellipfun(name, x, m=m)) for x in v])
            assert np.abs(points.quotient(function).real - known).max() < 4e-15  # measured 1.2e-15


def test_jacobi_functions_on_the_separatrix_are_hyperbolic():
    lattice = Lattice.of(mp.mpf(1), mp.mpf(0))
    v = np.array([-500.0, -40.0, -3.0, -0.2, 0.0, 1e-9, 0.5, 7.0, 1e6])
    sn, cn, dn = (Points(lattice, v).quotient(f).real for f in jacobi(lattice))
    sech = 1 / np.cosh(np.minimum(np.abs(v), 700))
    np.testing.assert_allclose(sn, np.tanh(v), rtol=1e-15, atol=1e-16)
    np.testing.assert_allclose(cn, sech, rtol=1e-13, atol=1e-300)  # measured 2e-16, relative, down to 1e-217
    np.testing.assert_allclose(dn, sech, rtol=1e-13, atol=1e-300)


@pytest.mark.parametrize("period", [2 * mp.pi, mp.mpf("61.7"), mp.mpf("1e-3")])
def test_a_clock_keeps_its_digits_however_late(period):
    clock = Clock(mp.mpf(1) / 3, mp.sqrt(2), period)
    t = np.array([0.0, -3.3, 1e3 + 0.1, 1e9 + 0.3, -1e12 - 0.7, 123456789012345.6])
    phase, odd = clock.reduce(t)
    for time, found, parity in zip(t, phase, odd, strict=True):
        off = (clock.start + clock.rate * mp.mpf(float(time)) - mp.mpf(float(found))) / period
        assert abs(off - mp.nint(off)) < 4e-16  # measured 1.1e-16
        assert int(mp.nint(off)) % 2 == parity
        assert abs(found) < 0.5000001 * period
    if period == 2 * mp.pi:
        turned = rotation_clock(clock.start, clock.rate).phasor(t)
        np.testing.assert_allclose(turned, np.exp(1j * phase), rtol=1e-15)


def test_a_clock_refuses_times_that_leave_nothing_of_the_phase():
    clock = rotation_clock(mp.mpf(0), mp.mpf(1))
    clock.reduce(np.array([7e18]))
    with pytest.raises(BadInput, match=r"t: got .* periods; allowed: times of up to 2\^60 periods, 7.24e\+18 s"):
        clock.reduce(np.array([0.0, -7.3e18]))
