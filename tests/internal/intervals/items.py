"""Items of a question as the units that are drawn, without a warning of few."""

from masrel.intervals._problem import IntervalProblem
from masrel.intervals._units import SamplingUnits, row_units


def item_units(problem: IntervalProblem) -> SamplingUnits:
    return row_units(problem, problem.rows, problem.freq)
