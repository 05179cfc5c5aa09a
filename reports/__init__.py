"""Showing: tables, pictures, the report and the command line."""

if __name__ != "conservative.reports":
    raise ImportError(f"{__name__} is part of another package. Use: import conservative.reports")
