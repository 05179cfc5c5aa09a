"""The sections of reports: one file each, which turns rows into headings, paragraphs, tables and figures."""
