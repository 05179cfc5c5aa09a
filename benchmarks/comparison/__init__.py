"""Two versions of a project against each other, in one run: times in turn, and what else the gate compares. No baseline."""
