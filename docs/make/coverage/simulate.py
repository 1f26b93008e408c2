"""Draw studies cell by cell and count which intervals hold the truth."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from docs.make.coverage.case import Case
from docs.make.coverage.latent import LatentTrait
from docs.make.coverage.methods import METHODS
from docs.make.coverage.multinomial import DirichletMultinomial
from docs.make.coverage.studies import Design, Model, Target

SEED = 20_260
KAPPAS = (0.2, 0.6, 0.9)
_OTHERS = (
    (4, 3),
    (6, 4),
    (6, 12),
    (8, 5),
    (8, 20),
    (11, 8),
    (12, 4),
    (12, 12),
    (20, 6),
)
DESIGNS, OTHERS = (
    tuple(Design(n_items=n, n_raters=r) for n, r in sizes)
    for sizes in (((4, 8), (16, 8), (30, 3), (100, 5)), (*_OTHERS, (30, 2)))
)
MODELS = ("Dirichlet-multinomial", "latent trait", "latent trait, strong biases")
TARGETS: tuple[Target, ...] = ("items", "raters", "both")


@dataclass(frozen=True, slots=True, kw_only=True)
class Counted:
    """What a method did in a cell: shares of studies, and a mean width."""

    coverage: float
    width: float
    answered: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """All methods in one cell.

    `spreadless` is the share of studies whose delta-method error is 0 or undefined,
    `single` the share with all ratings in one category, `truth` the mean of kappa
    over studies.
    """

    target: Target
    model: str
    design: Design
    kappa: float
    n_studies: int
    methods: Mapping[str, Counted]
    spreadless: float
    single: float
    truth: float

    def error(self, coverage: float) -> float:
        """Monte Carlo standard error of a coverage."""
        share = (coverage * self.n_studies + 1.0) / (self.n_studies + 2.0)
        return float(np.sqrt(share * (1.0 - share) / self.n_studies))


def model_of(name: str, kappa: float) -> Model:
    """Return a generating model by its name."""
    if name == MODELS[0]:
        return DirichletMultinomial(kappa=kappa)
    return LatentTrait(kappa=kappa, bias=0.5 if name == MODELS[1] else 1.0)


def draw_case(
    target: Target, model: str, design: Design, kappa: float, size: int
) -> Case:
    """Draw the studies of a cell, the same ones in every run."""
    place = (TARGETS.index(target), MODELS.index(model), design.n_items)
    seed = (SEED, *place, design.n_raters, round(1000 * kappa))
    rng = np.random.Generator(np.random.PCG64(seed))
    return Case.of(model_of(model, kappa).draw(size, design, target, rng))


def simulate(
    target: Target, model: str, design: Design, kappa: float, size: int
) -> Cell:
    """Count a cell."""
    case = draw_case(target, model, design, kappa, size)
    truth = case.studies.truth
    methods = {}
    for name, method in METHODS[target].items():
        bounds = method(case)
        width = np.where(bounds.exist, bounds.high - bounds.low, np.nan)
        methods[name] = Counted(
            coverage=float(bounds.cover(truth).mean()),
            width=float(np.nanmean(width)),
            answered=float(bounds.exist.mean()),
        )
    return Cell(
        target=target,
        model=model,
        design=design,
        kappa=kappa,
        n_studies=size,
        methods=methods,
        spreadless=float(1.0 - (case.spread.error > 0.0).mean()),
        single=float(np.isnan(case.value).mean()),
        truth=float(np.nanmean(truth)),
    )


Question = tuple[Target, str, Design, float]


def all_cells(designs: Sequence[Design] = DESIGNS) -> Iterator[Question]:
    """Yield target, model, design and kappa of every cell.

    With two raters, leaving one out leaves no pair: other items only.
    """
    for target in TARGETS:
        for model in MODELS:
            for design in designs:
                if target == "items" or design.n_raters > 2:
                    for kappa in KAPPAS:
                        yield target, model, design, kappa
