"""Scene files: a body, a potential and a start in TOML."""
