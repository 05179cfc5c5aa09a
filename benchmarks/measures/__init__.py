"""Measures of a run: errors, drifts, orders and times, and the tidy row of each value."""
