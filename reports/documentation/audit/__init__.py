"""Is every number in a sentence carried by a measured row? An audit of README, and of a finished report."""
