"""How much an attack tries.

pytest --attack                                                      # all attacks, a few minutes
ATTACK_EFFORT=100 pytest --attack tests/attack/test_hostile_input.py # a hundred times as many tries of one
ATTACK_SEED=7 pytest --attack tests/attack/test_threads.py           # other tries, where an attack has a seed
"""

import os

from hypothesis import HealthCheck, settings

EFFORT = float(os.environ.get("ATTACK_EFFORT", "1"))
SEED = int(os.environ.get("ATTACK_SEED", "1"))


def count(usual):
    """Return the number of tries, of an attack that usually has this many."""
    return max(1, round(usual * EFFORT))


def tries(usual):
    """Return settings for an attack by Hypothesis, which shrinks what it finds and tries it first next time."""
    return settings(max_examples=count(usual), suppress_health_check=list(HealthCheck))
