"""Agreement on the spans in a file: unitizing alpha, and F1 of every two observers."""

import warnings
from collections.abc import Mapping, Sequence
from typing import Any, get_args

from masrel.agreement import SpanMatch, span_f1, unitizing_alpha
from masrel.analysis._file_estimates import AgreementRow, Answer
from masrel.errors import MasrelWarning


def span_answer(
    rows: Sequence[tuple[Any, ...]],
    lengths: Mapping[str, int],
    off: float,
    level: float,
) -> Answer:
    """Return alpha, if it is known how long all documents are, and F1."""
    # off: by how much of a step a place was rounded at most
    documents, observers = ({row[k] for row in rows} for k in (0, 1))
    n_absent = len(documents) * len(observers) - len({row[:2] for row in rows})
    is_known = documents <= lengths.keys()
    names = ("document", "observer", "category", "begin", "length")
    spans = dict(zip(names, zip(*rows, strict=True), strict=False))
    with warnings.catch_warnings(action="ignore", category=MasrelWarning):
        alpha = is_known and unitizing_alpha(spans, length=lengths, level=level)
        estimates = [
            *(
                ("Unitizing α", *of)
                for of in (alpha.estimates.items() if alpha else ())
            ),
            *(
                (f"F1, {match}", " and ".join(map(str, of)), estimate)
                for match in get_args(SpanMatch)
                for of, estimate in span_f1(spans, match=match, level=level).items()
            ),
        ]
    n_spans = sum(label is not None for _, _, label, *_ in rows)
    notes = {
        f"Spans: {n_spans}; observers: {len(observers)}.": True,
        "CI: from leaving out one document at a time, for other documents like these. "
        "Tokens: places, such as characters or steps.": True,
        "No unitizing α: it needs the length of every document; name its column with "
        "--length or --text.": not is_known,
        "An observer without a row for a document is treated as not having annotated "
        f"it ({n_absent} times).": n_absent,
        f"Places are rounded, by up to {off:.2g} of a step.": off,
    }
    return Answer(
        name="spans",
        heads={"of": "Of"},
        notes=tuple(text for text, is_so in notes.items() if is_so),
        estimates=tuple(
            AgreementRow(
                keys={"of": None if of is None else f"{of}"},
                title=title,
                estimate=estimate,
            )
            for title, of, estimate in estimates
        ),
    )
