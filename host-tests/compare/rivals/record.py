"""What a solver has seen: the best chain that keeps the rules, how many chains, and when one was first good enough, or on a
level with the chain that solvers are compared with."""

import math
import time

# By how much a rule may be broken: a micrometre on a kilometre, for rounding.
SLACK = 1e-9


class TimeUp(Exception):
    """The time limit has passed."""


class Record:
    """Kept while one solver works on one problem; the clock runs from its making.

    It counts time on the processor: what other programs take of the machine in between is not the solver's.
    """

    def __init__(self, problem, limit_s, good_sir, level_sir):
        self._problem = problem
        self._limit_s = limit_s
        self._good, self._level = math.log(good_sir), math.log(level_sir)
        self.evaluations = 0
        self.worst = -math.inf
        self.choices = None
        self.good = self.level = None
        self.time_s = None
        self._began = time.process_time()

    def left_s(self):
        """Time that is left, s; negative when it is up."""
        return self._limit_s - self.elapsed_s()

    def elapsed_s(self):
        """Time on the processor since the beginning, s."""
        return time.process_time() - self._began

    def check_time(self):
        """Raises TimeUp when no time is left."""
        if self.left_s() <= 0.0:
            raise TimeUp

    def see(self, choices, worst, margins):
        """Takes note of a chain: ln SIR of its worst hop, and its margins of the rules."""
        if worst > self.worst and (margins.size == 0 or margins.min() >= -SLACK):
            self.worst, self.choices = float(worst), choices.copy()
            if self.good is None and worst >= self._good:
                self.good = self._mark(choices)
            if self.level is None and worst >= self._level:
                self.level = self._mark(choices)

    def _mark(self, choices):
        return {"after_s": self.elapsed_s(), "chain": self._problem.chain(choices)}

    def stop(self):
        """Stops the clock."""
        self.time_s = self.elapsed_s()

    def reply(self):
        """What there is to tell."""
        if self.choices is None:
            return {"error": f"no chain that keeps the rules in {self.time_s:.1f} s"}
        found = {
            "time_s": self.time_s,
            "evaluations": self.evaluations,
            "sir": math.exp(self.worst),
            "chain": self._problem.chain(self.choices),
            "good": self.good,
            "level": self.level,
            "cut": self.time_s >= self._limit_s,
        }
        return {"found": found}
