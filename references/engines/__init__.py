"""Engines, one file each: somebody else's code, in its best configuration and its own loop."""
