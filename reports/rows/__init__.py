"""Selections of rows for sections and charts: names, classes, points and lines."""
