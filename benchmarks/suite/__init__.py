"""The benchmarks that `pytest --benchmark` collects."""
