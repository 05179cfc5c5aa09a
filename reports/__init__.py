"""Showing: tables, pictures, the report and the command line."""

if __name__ != "conservative.reports":
    raise ImportError(f"{__name__}: got another name than its own; allowed: import conservative.reports")
