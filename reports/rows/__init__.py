"""What sections and charts read from rows: names, classes, points and lines."""
