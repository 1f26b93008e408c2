"""The page of the latent-trait model says what there is, and what comes out."""

import re
from pathlib import Path

import pytest

from masrel.intervals import LatentTrait, latent_trait
from tests.intervals.data import SCALE, TABLE_V

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "howto" / "latent_trait.md").read_text(encoding="utf-8")
RATERS = {"Table V, 4 × 8": range(8), "its raters 1, 4, 6: 4 × 3": (0, 3, 5)}
ROWS = re.findall(
    r"^\| (.*\d) \| (fixed|random) \| (.*) to (.*) \| (.*) to (.*) \|$",
    PAGE,
    flags=re.MULTILINE,
)


FEWEST = ("its raters 1, 4, 6: 4 × 3", "fixed")


def test_there_is_something_to_check() -> None:
    assert {(study, items) for study, items, *_ in ROWS} == {
        (study, items) for study in RATERS for items in ("fixed", "random")
    }


def ends(result: LatentTrait) -> list[float]:
    assert result.kappa.interval is not None
    return [result.kappa.interval.low, result.kappa.interval.high]


# All eight raters and new items take longest, and tests/golden has studies of both.
@pytest.mark.parametrize(
    "row",
    [
        pytest.param(
            row, marks=pytest.mark.slow if row[:2] == FEWEST else pytest.mark.long
        )
        for row in ROWS
    ],
    ids=lambda row: " ".join(row[:2]),
)
def test_the_table_of_priors_is_what_comes_out(
    row: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    # Shorter chains than the page's: errors of at most .008 at an end, so that two
    # hundredths are missed in 1 of 80 runs of other seeds at the most.
    monkeypatch.setattr("masrel.intervals.latent._sampler.MIN_ESS", 1_500.0)
    monkeypatch.setattr("masrel.intervals.latent._sampler.MAX_R_HAT", 1.03)
    study, items, *said = row
    result = latent_trait(
        [[grades[r] for r in RATERS[study]] for grades in TABLE_V],
        items=items,  # type: ignore[arg-type]
        categories=SCALE,
        n_steps=400,
        rng=4,
    )
    assert result.other is not None
    assert ends(result) + ends(result.other) == pytest.approx(
        [float(number) for number in said], abs=0.02
    )
