"""Compare two versions of a project in one run: accuracy as the gate compares it, and times in turn. No stored baseline."""
