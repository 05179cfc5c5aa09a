"""Bodies that engines load from model files."""

from .loaded import verify_files

__all__ = ["verify_files"]
