"""Charts, the same for page and picture."""
