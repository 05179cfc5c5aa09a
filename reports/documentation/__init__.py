"""What the documentation is made with: API pages, the pictures of the READMEs and the README's table of costs."""
