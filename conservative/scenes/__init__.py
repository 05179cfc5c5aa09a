"""Scenes: one file a family, with its defaults, its source and its builders."""

from .brick_flip import brick_flip as brick_flip
from .lagrange_top import lagrange_top as lagrange_top
