"""Closed forms of the free body and the Lagrange top."""
