"""A run of the report: plan, measurements, checkpoints and provenance."""
