"""What is measured of a run: errors, drifts, orders and times, and the tidy row each value becomes."""
