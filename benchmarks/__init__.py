"""Measuring: errors, order, timing, studies, and the pytest plugin."""
