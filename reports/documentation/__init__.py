"""What the documentation is made with: API pages and the README's pictures."""
