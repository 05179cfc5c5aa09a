"""Twins: two descriptions of one motion, which an engine has to move equally. No reference solution is needed."""
