"""Chains to start from."""

import numpy as np

from problem import SPAN

# Starts of a local method: relays at equal spacings, at these altitudes (0 is the bottom of the band, 1 its top), then relays
# anywhere.
HEIGHTS = (0.5, 0.0, 1.0, 0.25, 0.75)
STARTS = 20


def equal(problem, height):
    """Equal spacings, all at one altitude: 0 for the bottom of the band to 1 for the top."""
    n = problem.relays
    x = np.arange(1, n + 1) / (n + 1)
    return SPAN * np.append(x, np.full(problem.choices - n, height))


def all_starts(problem, rng):
    """Every start. At a given altitude equal spacings are one and the same, and random chains take their turn."""
    heights = HEIGHTS if problem.chooses_altitudes else HEIGHTS[:1]
    for height in heights:
        yield equal(problem, height)
    for _ in range(STARTS - len(heights)):
        yield problem.in_order(rng.uniform(0.0, SPAN, problem.choices))
