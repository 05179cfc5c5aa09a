"""A run of the report: its plan, its measurements, its checkpoints, and where they come from."""
