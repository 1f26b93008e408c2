"""The numbers of 2 000 tables are those stored, and what may differ is let through."""

import pytest

from tests.golden import numbers
from tests.golden.compare import beyond, changes
from tests.golden.store import differing

MOST_SAID = 15


def _parts() -> list[object]:
    """Tables in parts: a twentieth in each run, few quick; all in the long tests."""
    parts: list[tuple[range, tuple[pytest.MarkDecorator, ...]]] = [
        (numbers.TENTH[::20], ()),
        *((numbers.TENTH[k::8], (pytest.mark.slow,)) for k in range(4)),
        *((range(k, numbers.N_TABLES, 20), (pytest.mark.long,)) for k in range(20)),
    ]
    return [
        pytest.param(of, id=f"every {of.step} from {of.start}", marks=marks)
        for of, marks in parts
    ]


@pytest.fixture(scope="module")
def tenth() -> dict[str, dict]:
    return numbers.load_tables(tenth_alone=True)


@pytest.mark.parametrize("seeds", _parts())
def test_nothing_changed(seeds: range, tenth: dict[str, dict]) -> None:
    stored = tenth if set(seeds) <= set(numbers.TENTH) else numbers.load_tables()
    tables = {f"{seed:04}": stored[f"{seed:04}"] for seed in seeds}
    # in another environment rounding decides otherwise where resamples all but tie
    wrong = beyond(*numbers.replayed(tables, draws_differ=bool(differing())))
    if wrong:
        head = f"{len(wrong)} differences in {len(tables)} tables"
        said = [str(change) for change in wrong[:MOST_SAID]]
        pytest.fail("\n".join([head, *said]), pytrace=False)


FEW = (
    "8 items: with fewer than 10 the true coverage may be below the level of the "
    "interval"
)
CUT = "the interval was cut at -1 or 1"
IN_ORDER, TURNED = ({"notes": notes} for notes in ([FEW, CUT], [CUT, FEW]))
ENDS = {"low": 0.2, "high": 0.6, "mce": [0.003, 0.004], "n_resamples": 1000}
FAR = ENDS | {"low": 0.2 + 3.0 * 0.003 * 2**0.5}
TOO_FAR = ENDS | {"high": 0.6 + 7.0 * 0.004 * 2**0.5}
BOTH_FAR = FAR | {"low": 0.2 + 5 * 0.003 * 2**0.5, "high": 0.6 + 5 * 0.004 * 2**0.5}


@pytest.mark.parametrize(
    ("draws_differ", "about", "before", "after", "n_wrong"),
    [
        (False, "value fleiss_kappa", {"value": 0.5}, {"value": 0.5 + 1e-15}, 0),
        (False, "value fleiss_kappa", {"value": 0.5}, {"value": 0.5 + 1e-13}, 1),
        (False, "value icc_1", {"value": 0.5}, {"value": 0.5 + 1e-13}, 0),
        (False, "value icc_1", {"value": 0.5}, {"value": float("nan")}, 1),
        (False, "value sem", {"refused": ["A", "x"]}, {"refused": ["A", "y"]}, 1),
        (False, "value gwet_ac", {"error": 0.1}, {"error": 0.1 * 1.0001}, 1),
        (False, "jackknife", IN_ORDER, TURNED, 2),
        (True, "bootstrap", ENDS | IN_ORDER, ENDS | TURNED, 0),
        (False, "bootstrap", ENDS, FAR, 1),
        (True, "bootstrap", ENDS, FAR, 0),
        (True, "bootstrap", ENDS, TOO_FAR, 1),
        (True, "bootstrap", ENDS | {"steps": [0.0, 0.1]}, TOO_FAR, 0),
        (True, "bootstrap", ENDS, BOTH_FAR, 2),
        (True, "bootstrap", ENDS, BOTH_FAR | {"high": 0.6}, 0),
    ],
)  # fmt: skip
def test_what_differs_is_seen(
    draws_differ: bool, about: str, before: dict, after: dict, n_wrong: int
) -> None:
    method, _, coefficient = about.rpartition(" ")
    where = f"/0000/{method or coefficient}/{coefficient}"
    made = changes("numbers", before, after, where=where, draws_differ=draws_differ)
    assert len(beyond(made, 2)) == n_wrong
