"""Mutants: small faults planted in the code one at a time, and the tests that have to notice each."""
