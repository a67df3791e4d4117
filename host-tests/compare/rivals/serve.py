"""Solves the placement problems it is handed, one JSON object a line, and answers each with one line.

A task is {"solver", "limit_s", "good_sir", "link"}; an answer has the best chain, the time and the number of chains that
were evaluated. Time is that of the solver alone, on the processor. What takes less than a second is run up to five times, always with the
same random numbers, and the answer is the one with the median time.
"""

import json
import platform
import sys

import nlopt
import numpy as np
import scipy

import nlopt_solvers
import scipy_solvers
from problem import Problem, check_slopes
from record import Record, TimeUp

SOLVERS = {
    "scipy-slsqp-one": scipy_solvers.BestStart(),
    "scipy-slsqp": scipy_solvers.slsqp,
    "scipy-de": scipy_solvers.evolution,
    "nlopt-slsqp": nlopt_solvers.slsqp,
    "nlopt-mlsl": nlopt_solvers.linkage,
}

SEED = 1
RUNS, ENOUGH_S = 5, 1.0


def run(solve, problem, record):
    """One run, timed."""
    try:
        solve(problem, record, np.random.default_rng(SEED))
    except TimeUp:
        pass
    record.stop()
    return record


def solve(task):
    """The answer to a task."""
    problem = Problem(task["link"])
    solver = SOLVERS[task["solver"]]

    def new_record():
        return Record(problem, task["limit_s"], task["good_sir"], task["level_sir"])

    if hasattr(solver, "try_out"):
        solver.try_out(problem, new_record)
    runs = []
    while len(runs) < RUNS and sum(record.time_s for record in runs) < ENOUGH_S:
        runs.append(run(solver, problem, new_record()))
    runs.sort(key=lambda record: record.time_s)
    return runs[(len(runs) - 1) // 2].reply()


def answer(line):
    """The answer to a line, whatever goes wrong."""
    try:
        return solve(json.loads(line))
    except Exception as error:  # The judge shows it as the result of this solver; the others go on.
        return {"error": f"{type(error).__name__}: {error}"}


def warm_up(task):
    """Runs every solver once on a small problem, so that no first call is timed; and checks the slopes they are given."""
    for solver in SOLVERS:
        solve(task | {"solver": solver, "limit_s": 0.2})
    check_slopes(Problem(task["link"]), np.random.default_rng(SEED))


def main():
    """Says which versions these are once warm, then answers."""
    warm_up(json.loads(sys.stdin.readline()))
    versions = {"python": platform.python_version(), "scipy": scipy.__version__}
    nlopt_version = f"{nlopt.version_major()}.{nlopt.version_minor()}.{nlopt.version_bugfix()}"
    print(json.dumps(versions | {"nlopt": nlopt_version}), flush=True)
    for line in sys.stdin:
        print(json.dumps(answer(line)), flush=True)


main()
