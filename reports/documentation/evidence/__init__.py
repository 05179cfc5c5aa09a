"""What README's numbers follow from: rows of the last measurements, where they come from, and what was measured by hand."""
