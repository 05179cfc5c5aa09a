"""Studies: which rows to make, from scenes x methods x steps."""
