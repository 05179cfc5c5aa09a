"""What Python calls for lanes: without the interpreter's lock, so that threads share the blocks."""

from __future__ import annotations

from . import entry
from .lanes_moser_veselov import march_eight


@entry
def run_free(constants, states, n_steps, every, out):
    """`lanes_moser_veselov.march_eight` as Python calls it."""
    march_eight(constants, states, n_steps, every, out)
