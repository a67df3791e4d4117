"""NLopt: LD_SLSQP from many starts, and G_MLSL_LDS."""

import nlopt
import numpy as np

from epigraph import Epigraph
from problem import SPAN
from scipy_solvers import GLOBAL_SHARE
from starts import all_starts, equal

# How sharply the smooth stand-in for the worst hop follows it: within ln(hops) / SHARPNESS of its ln SIR.
SHARPNESS = 100.0

# G_MLSL_LDS never ends by itself; 300 evaluations end at the same optima in every problem here.
MLSL_EVALUATIONS = 1000


def _run(optimiser, start):
    """Runs to the end. NLopt reports it as a failure when rounding ended it; what was reached by then is on record."""
    try:
        optimiser.optimize(start)
    except (nlopt.RoundoffLimited, nlopt.ForcedStop, nlopt.runtime_error):
        pass


def climb(problem, record, choices):
    """LD_SLSQP from one chain, to 1e-10 in ln SIR or 2000 evaluations."""
    record.check_time()
    epigraph = Epigraph(problem, record)

    def ascent(unknowns, gradient):
        if gradient.size > 0:
            gradient[:] = epigraph.ascent
        return unknowns[-1]

    def limits(result, unknowns, gradient):
        result[:] = -epigraph.values(unknowns)
        if gradient.size > 0:
            gradient[:] = -epigraph.slopes(unknowns)

    optimiser = nlopt.opt(nlopt.LD_SLSQP, epigraph.unknowns)
    optimiser.set_max_objective(ascent)
    optimiser.add_inequality_mconstraint(limits, np.full(epigraph.count, 1e-9))
    optimiser.set_lower_bounds(epigraph.low)
    optimiser.set_upper_bounds(epigraph.high)
    optimiser.set_ftol_abs(1e-10)
    optimiser.set_xtol_rel(1e-9)
    optimiser.set_maxeval(2000)
    _run(optimiser, epigraph.start(choices))


def slsqp(problem, record, rng):
    """The best of all starts."""
    for choices in all_starts(problem, rng):
        climb(problem, record, choices)


def linkage(problem, record, rng):
    """Multi-level single linkage with LD_LBFGS on a smooth stand-in for the worst hop; LD_SLSQP finishes the best."""
    nlopt.srand(int(rng.integers(1 << 31)))
    budget_s = GLOBAL_SHARE * record.left_s()
    best = {"soft": -np.inf, "choices": equal(problem, 0.5)}

    def soft_worst(choices, gradient):
        order = np.argsort(choices[: problem.relays])
        where = np.append(order, np.arange(problem.relays, problem.choices))
        chain = choices[where]
        logs, slopes = problem.ln_sirs(chain)
        record.evaluations += 1
        record.see(chain, logs.min(), problem.rules(chain)[0])
        weights = np.exp(SHARPNESS * (logs.min() - logs))
        soft = logs.min() - np.log(weights.sum()) / SHARPNESS
        if soft > best["soft"]:
            best.update(soft=soft, choices=chain)
        if record.elapsed_s() > budget_s:
            optimiser.force_stop()
        if gradient.size > 0:
            gradient[where] = weights @ slopes / weights.sum()
        return soft

    local = nlopt.opt(nlopt.LD_LBFGS, problem.choices)
    local.set_ftol_abs(1e-7)
    local.set_xtol_rel(1e-5)
    optimiser = nlopt.opt(nlopt.G_MLSL_LDS, problem.choices)
    optimiser.set_max_objective(soft_worst)
    optimiser.set_lower_bounds(np.zeros(problem.choices))
    optimiser.set_upper_bounds(np.full(problem.choices, SPAN))
    optimiser.set_local_optimizer(local)
    optimiser.set_maxeval(MLSL_EVALUATIONS)
    _run(optimiser, best["choices"])
    climb(problem, record, best["choices"])
