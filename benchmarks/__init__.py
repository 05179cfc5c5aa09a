"""Measuring: errors, order, timing, studies, and the pytest plugin."""

if __name__ != "conservative.benchmarks":
    raise ImportError(f"{__name__}: got another name than its own; allowed: import conservative.benchmarks")
