"""The pages of public names, and a notebook."""
