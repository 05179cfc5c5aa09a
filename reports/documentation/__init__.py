"""What the documentation is made with, API pages, pictures and tables, and what audits its numbers."""
