"""Whether recorded motions, programs, engines and loaded bodies are right, and the mistakes that explain what is wrong.

For example:

    import conservative as cv

    for verification in cv.verification.verify(["run.csv"], body="my_body.toml"):
        print(verification.sentence)
        for finding in verification.findings:
            print(finding.case, finding.verdict, finding.error, finding.allowed, finding.mistake)
"""

from .finding import CHECKS, Cause, Finding, Standing, Verdict, Verification
from .verify import Kind, kind_of, verify

__all__ = ["CHECKS", "Cause", "Finding", "Kind", "Standing", "Verdict", "Verification", "kind_of", "verify"]
