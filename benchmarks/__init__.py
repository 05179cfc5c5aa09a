"""Measuring: errors, order, timing, studies, and the pytest plugin."""

if __name__ != "conservative.benchmarks":
    raise ImportError(f"{__name__} is part of another package. Use: import conservative.benchmarks")
