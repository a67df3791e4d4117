"""SciPy: SLSQP from many starts, and differential evolution."""

import numpy as np
from scipy.optimize import differential_evolution, minimize

from epigraph import Epigraph
from problem import SPAN
from record import TimeUp
from starts import all_starts, equal, equal_starts

# Share of the time limit for the search that is global; the rest is for its finish.
GLOBAL_SHARE = 0.8

# What a share of the least separation that is missing costs, in ln SIR.
CROWDING_COST = 10.0


def climb(problem, record, choices):
    """SLSQP from one chain, with slopes, to 1e-10 in ln SIR or 500 iterations."""
    epigraph = Epigraph(problem, record)
    minimize(
        lambda unknowns: -unknowns[-1],
        epigraph.start(choices),
        jac=lambda _: -epigraph.ascent,
        bounds=list(zip(epigraph.low, epigraph.high)),
        constraints=[{"type": "ineq", "fun": epigraph.values, "jac": epigraph.slopes}],
        method="SLSQP",
        options={"ftol": 1e-10, "maxiter": 500},
    )


def slsqp(problem, record, rng):
    """The best of all starts."""
    for choices in all_starts(problem, rng):
        climb(problem, record, choices)


class BestStart:
    """SLSQP from one chain: of all with equal spacings the one from which it is as good as the level to meet soonest.

    Which one that is, is found out beforehand, by `try_out`, and not timed; nobody knows it before all have been run.
    """

    def __init__(self):
        self._choices = None

    def try_out(self, problem, new_record):
        """Runs all of them."""

        def worth(choices):
            record = new_record()
            try:
                climb(problem, record, choices)
            except TimeUp:
                pass
            reached = record.level is not None
            return (reached, -record.level["after_s"] if reached else record.worst)

        self._choices = max(equal_starts(problem), key=worth)

    def __call__(self, problem, record, rng):
        climb(problem, record, self._choices)


def evolution(problem, record, rng):
    """Differential evolution on the worst hop of the chain with its places in order; SLSQP finishes the best.

    Whole populations are evaluated at once. It ends when the population agrees to 1e-6.
    """

    def cost(population):
        chains = problem.in_order(population.T)
        record.evaluations += len(chains)
        return CROWDING_COST * problem.crowding(chains) - problem.worst(chains)

    budget_s = GLOBAL_SHARE * record.left_s()

    def generation(intermediate_result):
        best = problem.in_order(intermediate_result.x)
        record.see(best, problem.worst(best), problem.rules(best)[0])
        return record.elapsed_s() > budget_s

    found = differential_evolution(
        cost,
        [(0.0, SPAN)] * problem.choices,
        strategy="rand1bin",
        popsize=15,
        mutation=(0.4, 0.7),
        recombination=0.95,
        maxiter=100_000,
        tol=1e-6,
        init="sobol",
        x0=equal(problem, 0.5),
        rng=rng,
        polish=False,
        vectorized=True,
        updating="deferred",
        callback=generation,
    )
    climb(problem, record, np.clip(problem.in_order(found.x), 0.0, SPAN))
