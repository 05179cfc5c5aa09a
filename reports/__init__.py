"""Showing: tables, pictures, the report and the command line."""
