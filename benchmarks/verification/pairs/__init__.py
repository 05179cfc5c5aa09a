"""Pairs: two descriptions of one motion, which an engine has to move equally. No reference solution is needed."""

from .verify import PairFinding, verify_pairs

__all__ = ["PairFinding", "verify_pairs"]
