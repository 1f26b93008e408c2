"""Raters some of whom are careless: whether the default holds kappa of others."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from docs.make.coverage.case import Case
from docs.make.coverage.methods import DEFAULT, METHODS
from docs.make.coverage.studies import Design, Studies, drawn, kappa_of_items

SEED = 20_263
SHARE = 0.2  # of raters
SIZES = tuple(
    Design(n_items=n, n_raters=r) for r in (3, 5, 8, 12, 20) for n in (16, 30, 100)
)
CAREFUL = 0.9
"""Chance that a careful rater gives an item its own grade, and no accident."""

_SHARES = (0.35, 0.3, 0.2, 0.15)


@dataclass(frozen=True, slots=True, kw_only=True)
class CarelessCell:
    """Coverage of the default in so many studies, in all and by careless raters."""

    design: Design
    coverage: float
    with_none: float  # share of the studies with no careless rater
    n_studies: int


def count_careless(size: int) -> Iterator[CarelessCell]:
    """Draw studies of every design, and count."""
    for design in SIZES:
        n, r = design.n_items, design.n_raters
        rng = np.random.Generator(np.random.PCG64((SEED, n, r)))
        shares = np.array(_SHARES)
        # items of each grade in proportion, the same in all studies
        grades = np.searchsorted(np.cumsum(shares), (np.arange(n) + 0.5) / n)
        careless = rng.random((size, 1, r, 1)) < SHARE
        careful = CAREFUL * np.eye(len(shares))[grades] + (1.0 - CAREFUL) * shares
        of_raters = np.where(careless, shares, careful[:, None, :])
        codes = drawn(of_raters, 1, rng)[..., 0]
        of_all = SHARE * shares + (1.0 - SHARE) * careful
        truth = np.full(size, kappa_of_items(of_all))
        case = Case.of(Studies(codes=codes, truth=truth, n_categories=len(shares)))
        bounds = METHODS["raters"][DEFAULT](case)
        yield CarelessCell(
            design=design,
            coverage=float(bounds.cover(truth).mean()),
            with_none=float((~careless.any(axis=(1, 2, 3))).mean()),
            n_studies=size,
        )
