"""Tell pytest about `--benchmark`."""
