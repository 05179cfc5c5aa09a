"""Model files: their links, without an engine, and the bodies that engines load from them."""

from .links import verify_links
from .loaded import verify_files
from .models import verify_models

__all__ = ["verify_files", "verify_links", "verify_models"]
