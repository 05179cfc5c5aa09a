"""The gate: results of a gated run, the committed baseline, their comparison, and the pytest plugin that runs it."""
