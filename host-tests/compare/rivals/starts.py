"""Chains to start from."""

import numpy as np

from problem import SPAN

# Starts of a local method: relays at equal spacings, at these altitudes (0 is the bottom of the band, 1 its top) and sides (0 is
# the left end of the room, 1 the right one), then relays anywhere.
HEIGHTS = (0.5, 0.0, 1.0, 0.25, 0.75)
SIDES = (0.5, 0.0, 1.0, 0.25, 0.75)
# Where both are chosen: each with the other at its usual value, the lowest altitude.
BOTH = tuple((0.0, side) for side in SIDES) + tuple((height, 0.5) for height in HEIGHTS if height > 0.0)
STARTS = 20


def equal(problem, height, side=0.5):
    """Equal spacings, all at one altitude, 0 for the bottom of the band to 1 for the top, and one side, 0 for left to 1."""
    n = problem.relays
    shares = {0: np.arange(1, n + 1) / (n + 1), 1: np.full(n, side), 2: np.full(n, height)}
    return SPAN * np.concatenate([shares[axis] for axis in problem.axes])


def equal_starts(problem):
    """Every start with equal spacings. At a given altitude there is one."""
    if 1 in problem.axes:
        shapes = BOTH
    elif 2 in problem.axes:
        shapes = tuple((height, 0.5) for height in HEIGHTS)
    else:
        shapes = ((HEIGHTS[0], 0.5),)
    return [equal(problem, height, side) for height, side in shapes]


def all_starts(problem, rng):
    """Every start: where equal spacings are fewer, random chains take their turn."""
    even = equal_starts(problem)
    yield from even
    for _ in range(STARTS - len(even)):
        yield problem.in_order(rng.uniform(0.0, SPAN, problem.choices))
