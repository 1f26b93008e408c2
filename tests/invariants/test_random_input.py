"""Odd input to every function of ratings: a value, a reason, or one sentence."""

import inspect
import math
import random
import re
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import pytest

import masrel.agreement
import masrel.intervals
from masrel.agreement import COEFFICIENTS, Significance
from masrel.errors import MasrelError, MasrelWarning
from masrel.estimates import Estimate, Interval
from tests.invariants.odd import OPTIONS, TABLES

USUAL = ["text", "two raters", "numbers", "pairs", "a frame", "an item missing"]
LONGEST = 700  # letters of a message
Call = tuple[str, Callable[[], Any]]

_A, _I = masrel.agreement, masrel.intervals
OF_RATINGS: list[Callable[..., Any]] = [
    *dict.fromkeys(
        getattr(e.function, "func", e.function) for e in COEFFICIENTS.values()
    ),
    *(_A.icc_f_test, _A.kendall_w_test, _A.fleiss_null, _A.count_ratings),
    *(_A.code_ratings, _A.code_long, _A.contingency_table, _I.retest_model),
    *(_A.count_table, _A.mcnemar, _A.bowker, _A.stuart_maxwell, _A.bhapkar),
    *(_A.prevalence_index, _A.bias_index, _A.kappa_max, _A.specific_agreement),
    *(_I.equality_test, _A.p_value, _A.bands, _A.benchmark, _A.strength, _A.holm),
    _A.count_items,
]
OF_COEFFICIENTS: list[Callable[..., Any]] = [
    *(_I.analytic, _I.jackknife, _I.bootstrap, _I.posterior, _I.estimate)
]
OF_TWO: list[Callable[..., Any]] = [_I.difference, _I.difference_test]
OF_SETS: list[Callable[..., Any]] = [_I.differences, _I.donner_test]


def options(function: Callable[..., Any], rng: random.Random) -> dict[str, Any]:
    """Return options of a function, of which one in twenty or so is odd."""
    chosen = {}
    for name in inspect.signature(function).parameters:
        if name == "target" and rng.random() < 0.9:
            chosen[name] = rng.choice(["items", "raters", "both"])
        elif name in OPTIONS and (name == "target" or rng.random() < 0.05):
            chosen[name] = rng.choice(OPTIONS[name])
    if "n_resamples" in inspect.signature(function).parameters:
        chosen.setdefault("n_resamples", 200)
    if function is _I.posterior:
        chosen.pop("method", None)  # a sampler of minutes
    return chosen


def drawn(seed: int, n_calls: int) -> Iterator[Call]:
    """Draw calls of functions with odd ratings."""
    rng = random.Random(seed)

    def table() -> str:
        return rng.choice(list(TABLES) if rng.random() < 0.4 else USUAL)

    for _ in range(n_calls):
        name, other = table(), table()
        coefficient = rng.choice([*COEFFICIENTS] * 4 + [None, 3, "x", len, ["x"], ""])  # type: ignore[list-item]
        group = rng.choices(
            [OF_RATINGS, OF_COEFFICIENTS, OF_TWO, OF_SETS], [5, 6, 1, 1]
        )
        function = rng.choice(group[0])
        chosen = options(function, rng)
        arguments: list[Any] = [lambda name=name: TABLES[name]()]
        if group[0] is OF_TWO:
            chosen["design"] = rng.choice(["dependent", "independent", "x"])
            arguments.append(lambda name=other: TABLES[name]())
        if group[0] is OF_SETS:
            arguments = [lambda one=name, two=other: [TABLES[one](), TABLES[two]()]]
        takes_none = group[0] is OF_RATINGS or function is _I.donner_test
        first = [] if takes_none else [coefficient]
        words = f"{function.__name__}({first}, {name!r}, {other!r}, {chosen})"
        yield (
            words,
            lambda f=function, c=first, a=arguments, o=chosen: f(
                *c, *(make() for make in a), **o
            ),
        )


def check(result: Any) -> None:
    """Hold a result to a value, or to nan with a reason."""
    if isinstance(result, Estimate):
        assert math.isnan(result.value) == (result.reason is not None)
        assert not re.search(r"\bnan\b", str(result))
        assert result._repr_html_().startswith("<table>")
        if result.interval is not None:
            check(result.interval)
    elif isinstance(result, Interval):
        is_nothing = math.isnan(result.low) or math.isnan(result.high)
        assert is_nothing == (result.reason is not None)
        assert is_nothing or result.low <= result.high
    elif isinstance(result, Significance):
        assert math.isnan(result.p_value) == (result.reason is not None)


@pytest.mark.parametrize(
    ("seed", "n_calls"),
    [
        pytest.param(1, 2_500, marks=pytest.mark.slow),
        pytest.param(2, 2_500, marks=pytest.mark.slow),
        pytest.param(3, 100_000, marks=pytest.mark.long),
    ],
)
def test_odd_input_gives_a_value_a_reason_or_one_sentence(
    seed: int, n_calls: int
) -> None:
    n_answers = n_refusals = 0
    for words, call in drawn(seed, n_calls):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MasrelWarning)
            try:
                result = call()
            except MasrelError as error:
                said = str(error)
                assert 0 < len(said) < LONGEST, words
                assert "\n" not in said, words
                n_refusals += 1
                continue
            except Exception as error:
                raise AssertionError(words) from error
        try:
            check(result)
        except AssertionError as error:
            raise AssertionError(f"{words} is {result}") from error
        n_answers += 1
    # both happen often, or nothing is tested
    assert n_answers > 0.1 * n_calls
    assert n_refusals > 0.1 * n_calls
