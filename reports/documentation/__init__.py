"""The site of the documentation, its own pages and the notebooks."""
