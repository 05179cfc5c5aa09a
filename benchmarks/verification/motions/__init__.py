"""Motions as files: short exact motions, the errors that correct methods make on them, and the mistakes that they catch."""
