"""The worst hop as a smooth problem: the largest t such that ln SIR - t >= 0 for every hop, and the rules of a chain.

The unknowns are the choices and, last, t. Every chain that is looked at is put on record.
"""

import numpy as np

from problem import SPAN


class Epigraph:
    """The constraints, with slopes; t is bounded to what powers and distances of a link can give."""

    LEAST_T, MOST_T = -40.0, 40.0

    def __init__(self, problem, record):
        self._problem, self._record = problem, record
        self.unknowns = problem.choices + 1
        self.low = np.append(np.zeros(problem.choices), self.LEAST_T)
        self.high = np.append(np.full(problem.choices, SPAN), self.MOST_T)
        self.count = problem.relays + 1 + problem.rules(np.zeros(problem.choices))[0].size
        self.ascent = np.append(np.zeros(problem.choices), 1.0)
        self._at = None
        self._values = self._slopes = None

    def start(self, choices):
        """The unknowns for a chain, with the t that it just meets."""
        return np.append(choices, self._problem.worst(choices))

    def values(self, unknowns):
        """The constraints, none of which may be negative."""
        self._look(unknowns)
        return self._values

    def slopes(self, unknowns):
        """A row of slopes for each."""
        self._look(unknowns)
        return self._slopes

    def _look(self, unknowns):
        if self._at is not None and np.array_equal(unknowns, self._at):
            return
        self._record.check_time()
        choices = unknowns[:-1]
        logs, by_choice = self._problem.ln_sirs(choices)
        margins, of_margins = self._problem.rules(choices)
        self._record.evaluations += 1
        self._record.see(choices, logs.min(), margins)
        self._values = np.append(logs - unknowns[-1], margins)
        self._slopes = np.zeros((self.count, self.unknowns))
        self._slopes[: logs.size, :-1] = by_choice
        self._slopes[: logs.size, -1] = -1.0
        self._slopes[logs.size :, :-1] = of_margins
        self._at = unknowns.copy()
