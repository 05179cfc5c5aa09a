"""Engines, one file each: code of other projects, in its best configuration and its own loop. They run without this package."""
