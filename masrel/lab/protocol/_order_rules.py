"""The rules of ``[schedule]``: keys that go together, and orders that exist."""

from collections import Counter
from collections.abc import Iterator
from itertools import chain
from typing import Any

from masrel.lab.protocol._decode import got, with_id
from masrel.lab.protocol.definition import ScheduleScheme

Values = dict[str, Any]

_BELONGS_TO = {
    "blocks_by": "blocks",
    "standards_apart": "restricted",
    "max_same_grade": "restricted",
}
"""Keys that say something of one scheme only."""


def order_rules(values: Values) -> Iterator[str]:
    """Check the scheme of orders, and that it leaves an order at all."""
    rules = values.get("schedule") or {}
    return chain(
        _keys(rules), _impossible(rules, values.get("models") or []), _sites(values)
    )


def _keys(rules: Values) -> Iterator[str]:
    scheme = rules.get("scheme")
    if scheme is None:
        return
    defaults = {key: getattr(ScheduleScheme(seed=0), key) for key in _BELONGS_TO}
    for key, owner in _BELONGS_TO.items():
        if rules.get(key, defaults[key]) != defaults[key] and scheme != owner:
            yield (
                f"schedule.{key}: needed with schedule.scheme = {got(owner)} only, "
                f"got it with {got(scheme)}"
            )
    limits = ("standards_apart", "max_same_grade")
    if scheme == "restricted" and all(
        rules.get(key, "unusable") == defaults[key] for key in limits
    ):
        yield (
            "schedule.scheme: needed standards_apart = true or max_same_grade beside "
            f"{got(scheme)}, got neither"
        )


def _impossible(rules: Values, models: list[Values | None]) -> Iterator[str]:
    # a scheme that no order of these models keeps
    scheme, repeats = rules.get("scheme"), rules.get("repeats")
    usable = [model for model in models if model is not None]
    if scheme is None or repeats is None or len(usable) < max(len(models), 1):
        return
    if (
        scheme in ("williams", "latin-square", "no-immediate-repeat")
        and len(usable) == 1
        and repeats > 1
    ):
        yield (
            "schedule.scheme: needed two models or more so that none comes twice in a "
            f"row, got one {repeats} times"
        )
    if any(model.get("role") is None for model in usable):
        return
    n_standards = sum(model["role"] == "standard" for model in usable)
    n_dummies = len(usable) - n_standards
    if scheme == "blocks" and rules.get("blocks_by") == "role" and not n_dummies:
        yield (
            "schedule.blocks_by: needed standards and dummies among the models with "
            '"role", got standards only'
        )
    if scheme == "blocks" and rules.get("blocks_by") == "role" and not n_standards:
        yield (
            "schedule.blocks_by: needed standards and dummies among the models with "
            '"role", got dummies only'
        )
    if scheme == "restricted":
        yield from _too_strict(rules, usable, n_standards * repeats, repeats)


def _too_strict(
    rules: Values, models: list[Values], n_standards: int, repeats: int
) -> Iterator[str]:
    # n_standards: presentations of standards in a session
    n_others = len(models) * repeats - n_standards
    limit, is_apart = rules.get("max_same_grade"), rules.get("standards_apart")
    if is_apart and n_standards > n_others + 1:
        yield (
            "schedule.standards_apart: needed an order without two standards in a row, "
            f"got {n_standards} presentations of standards, between which {n_others} "
            f"of dummies leave room for {n_others + 1}"
        )
    graded = [model for model in models if model.get("intended_grade") is not None]
    if limit is None:
        return
    of_grade = Counter(model["intended_grade"] for model in graded)
    for grade, n_models in of_grade.items():
        n_same, n_other = n_models * repeats, (len(models) - n_models) * repeats
        if n_same > limit * (n_other + 1):
            yield (
                f"schedule.max_same_grade: needed an order with at most {limit} of one "
                f"grade in a row, got {n_same} presentations of grade {got(grade)}, "
                f"between which {n_other} others leave room for "
                f"{limit * (n_other + 1)}"
            )


def _sites(values: Values) -> Iterator[str]:
    # with strata everybody has a site, and none is written in two ways
    raters = values.get("raters") or []
    by_site = (values.get("schedule") or {}).get("strata") == "site"
    first: dict[str, str] = {}
    for index, rater in enumerate(raters):
        site = None if rater is None else rater.get("site", "unusable")
        if rater is None or site == "unusable":
            continue
        where = f"raters[{index}].site"
        if site is None and by_site:
            yield (
                f'{where}: needed the id of a site with schedule.strata = "site", got '
                f"none{with_id(rater)}"
            )
        if site is not None and first.setdefault(site.casefold(), site) != site:
            yield (
                f"{where}: needed sites that differ by more than case, got {got(site)} "
                f"beside {got(first[site.casefold()])}{with_id(rater)}"
            )
