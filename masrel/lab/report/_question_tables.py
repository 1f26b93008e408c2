"""Section `questionnaires`: what the raters answered, without saying who did."""

import math
from collections import Counter
from decimal import ROUND_HALF_UP, Decimal

from masrel.lab.analysis import QuestionSummary
from masrel.lab.analysis._question_summaries import FEWEST_RATERS
from masrel.lab.protocol import Protocol
from masrel.lab.report._material import Material
from masrel.pages._sections import Drawing, Paragraph, Section, absent_section
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import Column, Table, Value

# the question and session; the answers, or ranges of them; how often each was given
_Panel = tuple[str, tuple[str, ...], tuple[int, ...]]

_TITLE = "Questionnaires"

_RECONSTRUCTED = (
    "Reconstructed answers are one set that fits the published mean and standard "
    "deviation, not the answers that were given."
)

_WITHHELD = (
    f"Where fewer than {FEWEST_RATERS} raters answered a question that is not public, "
    "only n is shown: more could show what one of them answered."
)

_COLUMNS = (
    Column(key="question", heading="Question", align="left"),
    Column(key="session", heading="Session", align="left"),
    Column(key="model", heading="Model", align="left"),
    Column(key="n", heading="n"),
    Column(key="n_missing", heading="Missing"),
    Column(key="mean_sd", heading="Mean ± SD (n − 1)", where="page"),
    Column(key="mean", heading="Mean", where="csv"),
    Column(key="sd", heading="SD (n − 1)", where="csv"),
    Column(key="median", heading="Median"),
    Column(key="least", heading="Least"),
    Column(key="most", heading="Most"),
    Column(key="counts", heading="Answers", align="left"),
)


def questionnaires_section(material: Material) -> Section:
    """Show how each question was answered, over all raters."""
    summaries = material.analysis.questionnaires
    if not any(summary.n for summary in summaries):
        return absent_section("questionnaires", _TITLE, "there are no answers")
    is_made_up = any(summary.is_reconstructed for summary in summaries)
    data = "reconstructed" if is_made_up else material.data
    texts = [
        f"{questionnaire.title}: {question.text} ({question.needed})."
        for questionnaire in material.protocol.questionnaires
        for question in questionnaire.questions
    ]
    blocks: list[Paragraph | Table | Drawing] = [Paragraph(text=text) for text in texts]
    notes = [_RECONSTRUCTED] * is_made_up
    notes += [_WITHHELD] * _is_any_withheld(material.protocol, summaries)
    blocks.append(
        Table(
            name="questionnaires",
            caption="Answers to each question, over all raters",
            columns=_COLUMNS,
            rows=tuple(_row(summary) for summary in summaries),
            notes=tuple(notes),
            data=data,
        )
    )
    panels = _panels(summaries)
    if panels:
        blocks.append(_drawing(material, panels, is_made_up=is_made_up))
    return Section(name="questionnaires", title=_TITLE, blocks=tuple(blocks))


def _is_any_withheld(
    protocol: Protocol, summaries: tuple[QuestionSummary, ...]
) -> bool:
    texts = {
        (questionnaire.id, question.id)
        for questionnaire in protocol.questionnaires
        for question in questionnaire.questions
        if question.type == "text"  # of which nothing but n is ever shown
    }
    return any(
        each.n and not each.counts and (each.questionnaire, each.question) not in texts
        for each in summaries
    )


def _row(summary: QuestionSummary) -> tuple[Value, ...]:
    has_numbers = summary.least == summary.least  # not ``nan``
    numbers: tuple[Value, ...] = (None,) * 6
    if has_numbers:
        ends = (summary.median, summary.least, summary.most)
        both = f"{_half_up(summary.mean, 2)} ± {_half_up(summary.sd, 2)}"
        numbers = (both, summary.mean, summary.sd, *ends)
    choices = None
    if not has_numbers and summary.counts:
        choices = ", ".join(f"{count.label}: {count.n}" for count in summary.counts)
    return (
        f"{summary.questionnaire}.{summary.question}",
        summary.session,
        summary.model,
        summary.n,
        summary.n_missing,
        *numbers,
        choices,
    )


def _panels(summaries: tuple[QuestionSummary, ...]) -> tuple[_Panel, ...]:
    # one for each question in each session, over all models
    counts: dict[str, Counter[str]] = {}
    for summary in summaries:
        of = "" if summary.session is None else f", {summary.session}"
        bars = counts.setdefault(
            f"{summary.questionnaire}.{summary.question}{of}", Counter()
        )
        bars.update({count.label: count.n for count in summary.counts})
    return tuple(
        (title, tuple(bars), tuple(bars.values()))
        for title, bars in counts.items()
        if bars.total()
    )


def _drawing(
    material: Material, panels: tuple[_Panel, ...], *, is_made_up: bool
) -> Drawing:
    words = "; ".join(
        f"{title}: "
        + ", ".join(f"{n} × {label}" for label, n in zip(*of, strict=True) if n)
        for title, *of in panels
    )
    caption = "The share of each answer, over all raters."
    return Drawing(
        name="questionnaires",
        caption=f"{caption} {_RECONSTRUCTED}" if is_made_up else caption,
        alt=f"Bars of answers. {words}.",
        content=Drawn("masrel.plots._grades:answer_pictures", (panels,)),
        stamp=_RECONSTRUCTED if is_made_up else material.stamp,
    )


def _half_up(value: float, decimals: int) -> str:
    # rounded as on paper: what lies in the middle goes up
    # Means of a few whole numbers often lie there; a float's own format goes to even.
    if math.isnan(value):
        return "undefined"
    unit = Decimal(1).scaleb(-decimals)
    text = str(Decimal(repr(value)).quantize(unit, ROUND_HALF_UP))
    return text.replace("-", "−")
