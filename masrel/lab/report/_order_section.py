"""Section `order`: whether grades depend on when a model came."""

from masrel.lab.analysis._exclusions import analysed_ratings
from masrel.lab.analysis._order_effects import (
    OrderEffect,
    PlaceSummary,
    compared,
    order_effects,
    place_summaries,
)
from masrel.lab.ratings import Ratings
from masrel.lab.report._material import Material
from masrel.lab.report._sentences import sentence
from masrel.pages._sections import Content, Paragraph, Section, absent_section
from masrel.tables._tables import Column, Table, percent

_TITLE = "Effects of order"


def shows_order(material: Material) -> bool:
    """Say whether the ratings can show any effect of order."""
    return bool(compared(material.protocol, _analysed(material)))


def order_section(material: Material) -> Section:
    """Show grades by place, after other models, and when a model came again."""
    analysis, protocol = material.analysis, material.protocol
    ratings = _analysed(material)
    effects = order_effects(protocol, ratings, analysis.level)
    places = place_summaries(protocol, ratings)
    if not effects:
        return absent_section("order", _TITLE, sentence("order", "nothing"))
    blocks: list[Content] = [Paragraph(text=sentence("order", "steps"))]
    if places:
        blocks.append(_places_table(material, places))
    else:
        blocks.append(Paragraph(text=sentence("order", "no_places"), absent=True))
    blocks.append(_effects_table(material, effects))
    return Section(name="order", title=_TITLE, blocks=tuple(blocks))


def _analysed(material: Material) -> Ratings:
    return analysed_ratings(material.ratings, material.analysis.excluded)


def _places(part: PlaceSummary) -> str:
    first, last = part.first, part.last
    return f"{first}–{last}" if first < last else str(first)


def _places_table(material: Material, places: tuple[PlaceSummary, ...]) -> Table:
    return Table(
        name="grades_by_place",
        caption="Grades by the place of the presentation in its session",
        columns=(
            Column(key="places", heading="Places", align="left"),
            Column(key="session", heading="Session", align="left"),
            Column(key="n_ratings", heading="Ratings"),
            Column(key="deviation_steps", heading="Mean difference", digits=2),
            Column(key="n_standard", heading="Of standard models"),
            Column(key="n_intended", heading="As intended"),
        ),
        rows=tuple(
            (
                _places(part),
                part.session,
                part.n,
                part.deviation,
                part.n_standard,
                part.n_intended,
            )
            for part in places
        ),
        data=material.data,
    )


def _effects_table(material: Material, effects: tuple[OrderEffect, ...]) -> Table:
    level = percent(material.analysis.level)
    notes = [sentence("order", "intervals", level=level)]
    notes += [
        f"{_question(effect)}: no interval, as {effect.reason}."
        for effect in effects
        if effect.reason is not None
    ]
    return Table(
        name="order_effects",
        caption="Differences of grades by order",
        columns=(
            Column(key="effect", heading="Difference", align="left"),
            Column(key="n_raters", heading="Raters"),
            Column(key="n_pairs", heading="Pairs"),
            Column(key="n_equal", heading="Equal pairs"),
            Column(key="mean_steps", heading="Mean", digits=2),
            Column(key="low", heading="Low", digits=2),
            Column(key="high", heading="High", digits=2),
        ),
        rows=tuple(
            (
                _question(effect),
                effect.n_raters,
                effect.n_pairs,
                effect.n_equal,
                effect.mean,
                effect.low,
                effect.high,
            )
            for effect in effects
        ),
        notes=tuple(notes),
        data=material.data,
    )


def _question(effect: OrderEffect) -> str:
    first, *_, last = (*effect.sessions, effect.sessions[-1])
    return sentence("order", effect.kind, first=first, last=last)
