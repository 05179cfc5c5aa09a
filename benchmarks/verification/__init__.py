"""Whether recorded motions, programs, engines and loaded bodies are right, and the mistakes that explain what is wrong.

For example:

    import conservative as cv

    for verification in cv.verification.verify(["run.csv"], body="my_body.toml"):
        print(verification.sentence)
        for finding in verification.findings:
            print(finding.case, finding.verdict, finding.error, finding.allowed, finding.mistake)
"""

from typing import TYPE_CHECKING, Any

from .finding import CHECKS, Cause, Finding, Standing, Verdict, Verification
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
    "Standing",
    "Verdict",
    "Verification",
    "kind_of",
    "parity",
    "verify",
]


def __getattr__(name: str) -> Any:
    """Return what needs kernels, which recordings do without."""
    if name == "BackEnd":
        from .back_ends import BackEnd

        return BackEnd
    if name == "parity":
        from .two_back_ends import parity

        return parity
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
