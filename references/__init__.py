"""Engines and exact solutions behind the same protocol, one file each, imported only when they are used."""

if __name__ != "conservative.references":
    raise ImportError(f"{__name__} is part of another package. Use: import conservative.references")
