"""Whether recorded motions, programs, engines and loaded bodies are right, and the mistakes that explain what is wrong.

For example:

    import conservative as cv

    for verification in cv.verification.verify(["run.csv"], body="my_body.toml"):
        print(verification.sentence)
        for finding in verification.findings:
            print(finding.case, finding.verdict, finding.error, finding.allowed, finding.mistake)

Tests of convergence, of any solver:

    cv.verification.assert_order([0.1, 0.05, 0.025, 0.0125], errors, order=4)
"""

from typing import TYPE_CHECKING, Any

from ..measures.convergence_order import Order, observed_order
from .finding import CHECKS, Cause, Finding, Standing, Verdict, Verification
from .order import OrderNotShown, OrderVerdict, assert_order, judge_order
from .verify import Kind, kind_of, verify

if TYPE_CHECKING:
    from .back_ends import BackEnd
    from .two_back_ends import parity

__all__ = [
    "CHECKS",
    "BackEnd",
    "Cause",
    "Finding",
    "Kind",
    "Order",
    "OrderNotShown",
    "OrderVerdict",
    "Standing",
    "Verdict",
    "Verification",
    "assert_order",
    "judge_order",
    "kind_of",
    "observed_order",
    "parity",
    "verify",
]


def __getattr__(name: str) -> Any:
    """Import `BackEnd` and `parity` when they are used: they need compiled kernels, and recordings do not."""
    if name == "BackEnd":
        from .back_ends import BackEnd

        return BackEnd
    if name == "parity":
        from .two_back_ends import parity

        return parity
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
