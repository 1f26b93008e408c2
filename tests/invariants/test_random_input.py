"""Odd input to every function of ratings: a value, a reason, or one sentence."""

import datetime
import decimal
import fractions
import inspect
import math
import random
import re
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pandas as pd
import pytest

import masrel.agreement
import masrel.intervals
from masrel.agreement import COEFFICIENTS, Significance
from masrel.errors import MasrelError, MasrelWarning
from masrel.estimates import Estimate, Interval

GIANT = 10**400

TABLES: dict[str, Callable[[], Any]] = {
    "text": lambda: [list("aba"), list("bbb"), list("aab"), list("aaa")],
    "two raters": lambda: [list("ab"), list("bb"), list("aa"), list("ba")],
    "numbers": lambda: [[1, 2, 1], [2, 2, 2], [3, 3, 1], [1, 1, 1]],
    "pairs": lambda: [[list("ab"), list("bb")], [list("aa"), list("ba")]],
    "pairs, array": lambda: np.array([[[1, 2], [2, 2]], [[1, 1], [2, 2]]]),
    "pairs, ragged": lambda: [[list("ab"), ["a"]], [list("aa"), list("bb")]],
    "pairs, missing": lambda: [[[None, None], ["a", None]], [list("aa"), list("bb")]],
    "perfect": lambda: [list("aaa"), list("bbb")],
    "same": lambda: [list("aaa")] * 5,
    "distinct": lambda: np.arange(60).reshape(20, 3),
    "wide": lambda: np.arange(60).reshape(2, 30) % 3,
    "nothing": lambda: [],
    "an empty row": lambda: [[]],
    "no rows": lambda: np.zeros((0, 3)),
    "no columns": lambda: np.zeros((3, 0)),
    "one item": lambda: [[1, 2, 1]],
    "one rating": lambda: [[1]],
    "one rater": lambda: [[1], [2], [1]],
    "all missing": lambda: [[None, None], [None, None]],
    "all nan": lambda: np.full((3, 2), np.nan),
    "all none": lambda: np.array([[None, None], [None, None]], dtype=object),
    "an item missing": lambda: [[1, 1, 2], [None] * 3, [2, 2, 2]],
    "NA and NaT": lambda: [[pd.NaT, pd.NaT], [pd.NA, None]],
    "masked": lambda: np.ma.array(
        [[1, 2], [2, 2], [1, 1]], mask=[[1, 0], [0, 0]] * 1 + [[0, 0]]
    ),
    "all masked": lambda: np.ma.masked_all((2, 2)),
    "empty text": lambda: [["", "a"], ["a", "a"]],
    "text of nan": lambda: [["nan", "a"], ["a", "a"]],
    "NUL": lambda: np.array([["a\0", "ab"], ["a", "a\0"]]),
    "half a letter": lambda: [["\ud800", "a"], ["a", "a"]],
    "mixed": lambda: [[1, "a"], ["a", 1]],
    "truth values": lambda: np.array([[True, False], [True, True]]),
    "giants": lambda: [[GIANT, 1], [1, GIANT], [2, 2]],
    "giants, array": lambda: np.array([[GIANT, 1], [1, GIANT]], dtype=object),
    "largest floats": lambda: np.array([[1e308, -1e308], [1e308, 1e308], [0, 1]]),
    "large floats": lambda: np.array([[1e160, 2e160], [3e160, 1e160], [5, 0]]),
    "smallest floats": lambda: np.array([[1e-308, 2e-308], [3e-308, 0], [5e-324, 0]]),
    "infinite": lambda: [[math.inf, 1.0], [1.0, -math.inf], [2.0, 2.0]],
    "infinite, array": lambda: np.array([[np.inf, 1], [1, -np.inf], [2, 2]]),
    "beyond floats": lambda: [[2**53, 2**53 + 1], [2**53, 2**53]],
    "negative zero": lambda: [[0.0, -0.0], [1.0, 1.0]],
    "half floats": lambda: np.array([[1, 2], [2, 2], [1, 1]], dtype=np.float16),
    "long floats": lambda: np.array([[1, 2], [2, 2], [1, 1]], dtype=np.longdouble),
    "largest integers": lambda: np.array([[2**64 - 1, 0], [0, 0]], dtype=np.uint64),
    "smallest integers": lambda: np.array([[-128, 127], [127, 127]], dtype=np.int8),
    "other byte order": lambda: np.array([[1, 2], [2, 2], [1, 1]], dtype=">f8"),
    "strided": lambda: np.arange(24).reshape(4, 6)[::2, ::2],
    "numpy's scalars": lambda: [[np.int8(1), np.float32(2)], [np.str_("a"), 2]],
    "bytes": lambda: [[b"a", b"b"], [b"b", b"b"]],
    "bytes, array": lambda: np.array([[b"a", b"b"], [b"b", b"b"]]),
    "complex": lambda: np.array([[1j, 2], [1, 1j]]),
    "decimals": lambda: [[decimal.Decimal("1.5"), decimal.Decimal("sNaN")]] * 2,
    "fractions": lambda: [[fractions.Fraction(1, 2), 1], [1, 1]],
    "dates": lambda: [[datetime.date(2020, 1, 1), datetime.date(2020, 1, 2)]] * 2,
    "dates, array": lambda: np.array([["2020-01-01"] * 2] * 2, dtype="datetime64[D]"),
    "records": lambda: np.zeros((2, 2), dtype=[("a", int)]),
    "objects": lambda: [[object(), object()], [object(), object()]],
    "no hash": lambda: [[NoHash(), 1], [1, 1]],
    "dots": lambda: [[..., ...], [..., ...]],
    "lists": lambda: [[[1], [2]], [[1], [1]]],
    "tuples": lambda: [[(1, 2), 3], [3, (1, 2)]],
    "sets": lambda: [[{"a"}, {"a", "b"}], [set(), {"b"}]],
    "mappings": lambda: [[{}, {}], [{}, {}]],
    "a mapping": lambda: {"a": [1, 2], "b": [1, 1]},
    "rows of mappings": lambda: [{"a": 1}, {"a": 2}],
    "rows of sets": lambda: [{1, 2}, {2, 3}],
    "ragged": lambda: [[1, 2], [1]],
    "three dimensions": lambda: np.zeros((2, 2, 2), dtype=int),
    "one dimension": lambda: np.array([1, 2, 3]),
    "no dimension": lambda: np.array(3),
    "a list": lambda: [1, 2, 3],
    "a string": lambda: "abc",
    "a number": lambda: 2.5,
    "None": lambda: None,
    "a type": lambda: int,
    "a generator": lambda: ([1, 2] for _ in range(3)),
    "rows of generators": lambda: [(x for x in (1, 2)), (x for x in (2, 2))],
    "an empty iterator": lambda: iter(()),
    "rows of ranges": lambda: [range(2), range(2)],
    "itself": lambda: itself(),
    "a series": lambda: pd.Series([1, 2, 3]),
    "a frame": lambda: pd.DataFrame({"A": [1, 2, 1], "B": [1, 2, 2]}),
    "an empty frame": pd.DataFrame,
    "a frame of mixed columns": lambda: pd.DataFrame({"A": [1, 2], "B": ["a", "b"]}),
    "a frame of Int64": lambda: pd.DataFrame(
        {"A": [1, None], "B": [1, 2]}, dtype="Int64"
    ),
    "a frame of strings": lambda: pd.DataFrame(
        {"A": ["a", None], "B": ["a", "b"]}, dtype="string"
    ),
    "a frame of truth values": lambda: pd.DataFrame(
        {"A": [True, None], "B": [True, False]}, dtype="boolean"
    ),
    "a frame of categories": lambda: pd.DataFrame(
        {"A": ["a", "b"], "B": ["a", "a"]}
    ).astype("category"),
    "a frame of empty categories": lambda: pd.DataFrame(
        {"A": pd.Categorical([None, None])}
    ),
    "a frame of bins": lambda: pd.DataFrame(
        {"A": pd.cut([1, 2, 3], 2), "B": pd.cut([1, 3, 3], 2)}
    ),
    "a frame of times": lambda: pd.DataFrame(
        {
            "A": pd.to_datetime(["2020-01-01", None]),
            "B": pd.to_datetime(["2020-01-01"] * 2),
        }
    ),
    "a frame of periods": lambda: pd.DataFrame(
        {"A": pd.period_range("2020", periods=2)}
    ),
    "a frame of lists": lambda: pd.DataFrame({"A": [[1], [2]], "B": [[1], [1]]}),
    "a sparse frame": lambda: pd.DataFrame(
        {"A": pd.arrays.SparseArray([1, 0]), "B": [1, 0]}
    ),
    "a frame of one name": lambda: pd.DataFrame([[1, 2], [2, 2]], columns=["A", "A"]),
}

OPTIONS: dict[str, list[Any]] = {
    "weights": [
        *(None, "linear", "quadratic", "ordinal", "ratio", "circular", "bipolar"),
        *("nonsense", "", 3, math.nan, True, len, object(), b"linear", {"a": 1}),
        *([], [[]], [[1, 0], [0, 1]], [[1, 2], [3, 4]], [[1, 0], [0]]),
        *(np.eye(3), np.eye(2) * 2, np.ones((2, 2)), np.zeros((2, 2, 2))),
        *(np.full((2, 2), np.nan), np.full((2, 2), np.inf), np.eye(2) * 1e-320),
        *([["a", "b"], ["c", "d"]], [[1, 1e308], [1e308, 1]], [[1, -5], [-5, 1]]),
        *([[None, 1], [1, None]], [[1j, 0], [0, 1]], [[GIANT, 0], [0, 1]]),
    ],
    "categories": [
        *(None, ["a", "b"], ["a", "b", "c"], [1, 2, 3], range(3), np.array(["a", "b"])),
        *([], ["a"], ["a", "a"], ["a", 1], "ab", 3, 0.5, [None], [math.nan], object()),
        *([math.inf, 1], {"a": 1}, {"a", "b"}, np.array([[1, 2], [3, 4]]), [[1], [2]]),
        *([object()], [True, False], [GIANT, 1], [1e308, -1e308], [b"a"], [1j]),
        *(pd.Index(["a", "b"]), ["a", None], [1, 2, 3, 1.0], ["", "a"], [{"a"}, {"b"}]),
    ],
    "level": [
        *(0.9, np.float64(0.9), 1e-300, 1 - 1e-16, 0, 1, -1, 95, math.nan, math.inf),
        *("0.95", None, True, [0.9], np.array([0.9, 0.5]), object(), 1j, GIANT),
    ],
    "target": ["items", "raters", "both", "xyz", "", None, 3, ["items"], object(), {}],
    "population": [3, 100, 1, 0, -1, 2.5, math.nan, "many", GIANT, True, [5]],
    "variance": ["delta", "irrcac", "x", None, 3, ["delta"]],
    "metric": ["nominal", "ordinal", "interval", "ratio", "masi", "x", 3, len],
    "n_resamples": [1000, 0, -1, 2.5, "many", None, math.nan, True, [5]],
    "rng": [0, None, -1, 2.5, "seed", True, np.random.RandomState(0), GIANT, [1]],
    "distribution": ["t", "normal", "logit", "fisher", "x", None, ["t"]],
    "error": ["delta", "over_n", "cohen", "irrcac", "unconditional", "x", None],
    "method": ["auto", "analytic", "jackknife", "bootstrap", "posterior", "x", None],
    "kind": ["percentile", "basic", "bca", "studentized", "x", None, ["bca"]],
    "clusters": [
        *([1, 1, 2, 2], [1], "ab", 5, [[1], [2]], [None] * 4, np.zeros((2, 2))),
        *(range(4), [math.nan] * 4, object(), {}),
    ],
    "concentration": [1.0, 0, -1, math.nan, math.inf, "x", 1e-300, 1e300, [1]],
    "prior": ["uniform", "jeffreys", "x", None, 3],
    "model": ["table", "x", 3],
    "exact": ["auto", True, False, "x", 3],
    "tolerance": [0, -1, "x", math.nan, [1]],
    "form": ["ICC(1)", "ICC(A,k)", "x", None, 3],
    "repeated": ["first", "last", "error", "x", None],
    "deletion": ["listwise", "pairwise", "x", None, 3],
}


class NoHash:
    """What no set can hold."""

    __hash__ = None  # type: ignore[assignment]


def itself() -> list[Any]:
    """A table that holds itself."""
    rows: list[Any] = [[1, 2], [1]]
    rows[1].append(rows)
    return rows


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
