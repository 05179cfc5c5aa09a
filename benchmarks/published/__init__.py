"""Figures that others have printed, measured anew: what they are, how each is measured, and what came of it."""
