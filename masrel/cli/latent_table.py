"""The tables and sentences of ``masrel latent``, and its JSON."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from masrel.estimates import as_document

if TYPE_CHECKING:
    from masrel.intervals import LatentTrait, Quantity
    from masrel.report._tables import Table, Value

__all__ = ["latent_document", "latent_table", "unlikely"]

_UNLIKELY = 0.01
"""Below this, or above one less it, a p-value of the predictive check is told of."""


def latent_table(
    found: "LatentTrait", file: Path, about: tuple[str, ...], data: str
) -> "Table":
    """Lay a result out as a table."""
    from masrel.report._tables import Column, Table

    columns = [
        Column(key="what", heading="What", align="left"),
        Column(key="of", heading="Of", align="left"),
        Column(key="median", heading="Median", digits=3),
        Column(key="low", heading="Low", digits=3),
        Column(key="high", heading="High", digits=3),
    ]
    if found.other is not None:
        columns += [
            Column(key="other_low", heading="Low, other prior", digits=3),
            Column(key="other_high", heading="High, other prior", digits=3),
        ]
    return Table(
        name="latent_trait",
        caption=f"Latent-trait model of the ratings in {file}",
        columns=tuple(columns),
        rows=tuple(_rows(found)),
        notes=(*about, *_notes(found)),
        data=data,
    )


def _parts(found: "LatentTrait") -> list[tuple[str, Iterable["Quantity"]]]:
    return [
        ("severity", found.items),
        ("threshold", found.thresholds),
        ("bias", found.raters),
        ("noise", found.noises),
        ("share of variance", found.shares),
    ]


def _rows(found: "LatentTrait") -> Iterator[tuple["Value", ...]]:
    other = found.other
    here = found.kappa.interval
    there = None if other is None else other.kappa.interval
    if here is not None:
        ends = [] if there is None else [there.low, there.high]
        yield ("kappa", "two new raters", found.kappa.value, here.low, here.high, *ends)
    others = [None] * 5 if other is None else [list(of) for _, of in _parts(other)]
    for (what, quantities), beside in zip(_parts(found), others, strict=True):
        for at, one in enumerate(quantities):
            of = one.interval
            ends = []
            if beside is not None:
                ends = [beside[at].interval.low, beside[at].interval.high]
            yield (what, one.name, one.value, of.low, of.high, *ends)


def _notes(found: "LatentTrait") -> Iterator[str]:
    yield from _meanings(found)
    yield f"Prior: {found.prior.words}."
    if found.other is not None:
        yield f"Other prior: {found.other.prior.words}."
    said = unlikely(found)
    if said:
        yield (
            "The model does not make ratings like these (predictive check): "
            f"{'; '.join(said)}."
        )
    else:
        yield "The model makes ratings like these (predictive check)."
    yield (
        f"{found.n_chains} chains of {found.n_steps} steps; R-hat at most "
        f"{found.r_hat:.4f}, effective size at least {found.ess:.0f}; seed "
        f"{found.seed}."
    )


def _meanings(found: "LatentTrait") -> Iterator[str]:
    # what the numbers speak of, and their unit
    from masrel.report._tables import number, percent

    interval = found.kappa.interval
    if interval is not None:
        whom = "these items" if interval.target == "raters" else "new items like these"
        yield (
            f"Kappa: agreement of two new raters on {whom}. Low and High: central "
            f"{percent(interval.level)} % credible interval."
        )
    yield (
        "Unit: the standard deviation of a rating; 0 is the mean severity of these "
        "items, and for biases the mean of all raters. A rater with a positive bias "
        "grades high; noise is how far the same item is perceived from one time to the "
        "next."
    )
    places = [one.value for one in found.thresholds]
    if len(places) > 1:
        apart = (places[-1] - places[0]) / (len(places) - 1)
        yield (
            f"Neighbouring thresholds are {number(apart, 2)} apart on average: a bias "
            "of that is about one grade."
        )


def unlikely(found: "LatentTrait") -> list[str]:
    """Say what of the ratings the model would hardly make."""
    return [
        f"{check.name} {check.observed:.3g}, expected {check.low:.3g} to "
        f"{check.high:.3g}"
        for check in found.checks
        if not _UNLIKELY <= check.p_value <= 1.0 - _UNLIKELY
    ]


def latent_document(found: "LatentTrait") -> dict[str, object]:
    """Turn a result into plain values for JSON, every digit kept."""
    parts = {
        "items": found.items,
        "thresholds": found.thresholds,
        "raters": found.raters,
        "noises": found.noises,
        "shares": found.shares,
        "noise_spread": (found.noise_spread,),
    }
    return {
        "kappa": as_document(found.kappa),
        **{name: [_quantity(one) for one in of] for name, of in parts.items()},
        "grades": [list(row) for row in found.grades],
        "checks": [
            {
                name: getattr(check, name)
                for name in ("name", "observed", "low", "high", "p_value")
            }
            for check in found.checks
        ],
        "prior": found.prior.words,
        "r_hat": found.r_hat,
        "ess": found.ess,
        "n_chains": found.n_chains,
        "n_steps": found.n_steps,
        "seed": found.seed,
        "other": None if found.other is None else latent_document(found.other),
    }


def _quantity(one: "Quantity") -> dict[str, object]:
    return {
        "name": one.name,
        "value": one.value,
        "interval": as_document(one.interval),
        "r_hat": one.r_hat,
        "ess": one.ess,
    }
