"""The smallest size of a study that reaches an aim, or that a budget pays for."""

from collections.abc import Callable
from dataclasses import replace

from masrel.errors import ParameterError
from masrel.planning._closed_forms import (
    critical,
    n_by_fit,
    n_by_fit_power,
    n_for_half_width,
    n_for_power,
    n_icc_assurance,
    n_icc_power,
    n_icc_width,
)
from masrel.planning._icc_studies import FORMS, ONE_WAY
from masrel.planning._plan_question import Question
from masrel.planning._precision import Plan, fit_cells, plan_by_formula, plan_of
from masrel.planning._studies import StudyDesign, StudyMaker

MAX_ITEMS, MAX_RATERS = 100_000, 60
_FAR = 1.3  # times a size: where a formula asks for more, the size does not do
_MAX_SCAN = 1_500_000  # tables that are looked at around a size


class Search:
    """The smallest number of items, or of raters, that reaches an aim."""

    def __init__(
        self, question: Question, *, n_items: int | None, n_raters: int | None
    ) -> None:
        self.question, self.n_items, self.n_raters = question, n_items, n_raters
        self._plans: dict[int, Plan] = {}

    @property
    def _name(self) -> str:
        return "items" if self.n_items is None else "raters"

    def _design(self, n: int) -> StudyDesign:
        if self.n_items is None:
            return self.question.design(n, self.n_raters or 0)
        return self.question.design(self.n_items, n)

    def at(self, n: int) -> Plan:
        """Return the plan of a size, computed once."""
        if n not in self._plans:
            self._plans[n] = plan_of(self.question, self._design(n))
        return self._plans[n]

    def plan(self) -> Plan:
        """Return the plan of the smallest size, or refuse with the best there is."""
        plan = self.reached()
        if plan.reaches_aim is False:
            raise ParameterError(plan.notes[0])
        return plan

    def reached(self) -> Plan:
        """Return the plan of the smallest size, or the best, with what it lacks."""
        question = self.question
        if question.method in ("wald", "goodness-of-fit"):
            plan = self._of_formula(self._by_formula())
        elif question.aim.kind is None:
            plan = self.at(self._affordable_size())
        else:
            plan = self.up_to(MAX_RATERS if self.n_items is not None else MAX_ITEMS)
        return self._affordable(plan)

    def up_to(self, highest: int) -> Plan:
        """Return the plan of the smallest size that is no larger than one."""
        guess = self._guess(self.lowest, highest)
        n = None
        if guess <= _FAR * highest:
            n = smallest(
                lambda size: self.question.aim.is_met(self.at(size)),
                guess=min(guess, highest),
                lowest=self.lowest,
                highest=highest,
            )
        return self._best(highest) if n is None else self._stable(n)

    @property
    def lowest(self) -> int:
        """The smallest size that the coefficient and the target can have."""
        if self.n_items is None:
            return 3 if self.question.is_icc else 2
        return self.question.min_raters

    def _guess(self, lowest: int, highest: int) -> int:
        # near the size by the normal formula; raters one by one from the fewest
        if self.n_items is not None:
            return lowest
        half = self.question.aim.distance(self.question.value)
        design = self._design(max(lowest, 20))
        z = critical(self.question.level, self.question.sides)
        if self.question.is_icc:
            n = n_icc_width(self.question.value, design.n_raters, 2 * half, z)
        elif self.question.target != "items" or not design.model.has_rows:
            n = min(20, highest)
        else:
            n = n_for_half_width(StudyMaker(design).item_sd(), half, z)
        return max(lowest, n)

    def _best(self, highest: int) -> Plan:
        aim, n = self.question.aim, highest
        if self.n_items is None and not self._design(20).has_rows:
            n = min(n, 200)  # a study of so many whose ratings are drawn one by one
        best = self.at(n)
        note = (
            f"{aim.name}: {aim.words} needs more than {highest} {self._name}; "
            f"the best that can be had with {n} is {aim.reached(best)}"
        )
        return replace(best, notes=(note,), reaches_aim=False)

    def _stable(self, n: int) -> Plan:
        # An exact chance goes up and down with n: from where on it holds.
        if not (self.question.aim.is_chance and self.at(n).method == "exact"):
            return self.at(n)
        if self.question.is_icc or self.n_items is not None:
            return self.at(n)
        around = range(max(self.lowest, int(0.85 * n)), int(1.25 * n) + 2)
        if sum(self._design(size).n_tables for size in around) > _MAX_SCAN:
            note = "larger sizes were not looked at: a chance can fall with one more"
            return replace(self.at(n), notes=(note,))
        is_met = {size: self.question.aim.is_met(self.at(size)) for size in around}
        first = min(size for size in around if is_met[size])
        stable = 1 + max((size for size in around if not is_met[size]), default=n - 1)
        if first == stable:
            return self.at(stable)
        note = (
            f"{first} {self._name} reach it first, but {stable - 1} do not: the chance "
            "goes up and down"
        )
        return replace(self.at(stable), notes=(note,))

    # -- formulas ---------------------------------------------------------------------

    def _of_formula(self, n: int) -> Plan:
        design = self._design(n)
        is_fit = self.question.method == "goodness-of-fit"
        if design.coefficient in FORMS or (is_fit and design.n_raters > 2):
            words = self.question.words(design)
            cost = self.question.cost(design.n_items, design.n_raters)
            return Plan(**words, method=self.question.method, cost=cost)
        return plan_by_formula(self.question, design)

    def _by_formula(self) -> int:
        if self.n_items is not None:
            raise ParameterError(
                f"method: {self.question.method} solves for items, not for raters: it "
                "needs n_raters"
            )
        self._check_has_formula()
        design = self._design(20)
        z = critical(self.question.level, self.question.sides)
        if self.question.is_icc:
            return self._icc_formula(design, z)
        if self.question.method == "wald":
            return self._wald_formula(design, z)
        return self._fit_formula(design, z)

    def _check_has_formula(self) -> None:
        aim, method = self.question.aim, self.question.method
        is_of_one_limit = self.question.is_icc and aim.upper is None
        if not aim.is_chance or aim.null is not None or is_of_one_limit:
            return
        name = "assurance" if aim.power is None else "power"
        raise ParameterError(
            f"{name}: method {method} has no formula of it for this aim; it needs "
            '"auto", "exact" or "simulation"'
        )

    def _wald_formula(self, design: StudyDesign, z: float) -> int:
        aim, value = self.question.aim, self.question.value
        sd = StudyMaker(design).item_sd()
        if aim.kind == "power" and aim.null is not None and aim.power is not None:
            sds = (StudyMaker(self.question.null_design(design)).item_sd(), sd)
            return n_for_power(sds, value - aim.null, z, aim.power)
        return n_for_half_width(sd, aim.distance(value), z)

    def _fit_formula(self, design: StudyDesign, z: float) -> int:
        aim, value = self.question.aim, self.question.value
        p = fit_cells(design)
        if aim.kind == "power" and aim.null is not None and aim.power is not None:
            null = fit_cells(self.question.null_design(design))
            return n_by_fit_power(p, null, z, aim.power)
        limits = [aim.lower, aim.upper]
        if aim.half_width is not None:
            limits = [value - aim.half_width, value + aim.half_width]
        return n_by_fit(
            p,
            [
                fit_cells(self.question.design_at(design, limit))
                for limit in limits
                if limit is not None
            ],
            z,
        )

    def _icc_formula(self, design: StudyDesign, z: float) -> int:
        aim, r, k = self.question.aim, self.question.value, design.n_raters
        if design.coefficient != ONE_WAY:
            raise ParameterError(
                f"method: the formulas are of icc_1, got {design.coefficient}"
            )
        chance_of = aim.power or aim.assurance
        limit = aim.null if aim.null is not None else aim.lower
        if limit is not None and chance_of is not None:
            return n_icc_power(r, limit, k, z, chance_of)
        half = aim.distance(r)
        if aim.assurance is not None:
            return n_icc_assurance(r, k, half, z, aim.assurance)
        return n_icc_width(r, k, 2.0 * half, z)

    # -- cost -------------------------------------------------------------------------

    def affordable(self, limit: float) -> int | None:
        """Return the largest size that costs no more than a limit, if any does."""
        cost, highest = self._cost, MAX_RATERS if self.n_items else MAX_ITEMS
        if cost(self.lowest) > limit:
            return None
        n = smallest(
            lambda size: cost(size + 1) > limit,
            guess=10,
            lowest=self.lowest,
            highest=highest,
        )
        return highest if n is None else n

    def _affordable_size(self) -> int:
        limit = self.question.max_cost or 0.0
        n = self.affordable(limit)
        if n is None or self._cost(n + 1) <= limit:
            raise ParameterError(
                f"max_cost: needs a limit between {self._cost(self.lowest):g}, of the "
                f"smallest study, and what some study costs; got {limit:g}"
            )
        return n

    def _cost(self, n: int) -> float:
        sizes = (n, self.n_raters or 0) if self.n_items is None else (self.n_items, n)
        return self.question.cost(*sizes)

    def _affordable(self, plan: Plan) -> Plan:
        limit = self.question.max_cost
        if limit is None or plan.cost <= limit or plan.reaches_aim is False:
            return plan
        aim, n = self.question.aim, self._affordable_size()
        note = (
            f"max_cost: {aim.words} needs {plan.n_items} items and {plan.n_raters} "
            f"raters, which cost {plan.cost:g}; {limit:g} pays for {n} {self._name}"
        )
        if self.question.method in ("wald", "goodness-of-fit"):
            return replace(plan, notes=(note,), reaches_aim=False)
        best = self.at(n)
        note += f", which reach {aim.reached(best)}"
        return replace(best, notes=(note,), reaches_aim=False)


def smallest(
    is_met: Callable[[int], bool], *, guess: int, lowest: int, highest: int
) -> int | None:
    """Return the smallest size that meets an aim, by steps and halves from a guess."""
    low, high = lowest - 1, min(max(guess, lowest), highest)  # not met, perhaps met
    step = max(1, high // 20)
    if is_met(high):
        while high - step > low and is_met(high - step):
            high, step = high - step, 2 * step
        low = max(low, high - step)
    else:
        while not is_met(high):
            if high == highest:
                return None
            low, high, step = high, min(high + step, highest), 2 * step
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if is_met(middle) else (middle, high)
    return high
