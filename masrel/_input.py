"""Input: checks of arguments, refusals in one sentence, and warnings."""

import re
import sys
import warnings
from collections.abc import Collection, Iterable

from masrel.errors import MasrelError, ParameterError

_MAX_LISTED = 40

USUAL_NAMES = {
    "item": (
        *("item", "item_id", "model", "subject", "subject_id", "patient", "patient_id"),
        *("case", "unit", "task", "task_id", "document", "video", "pair"),
    ),
    "rater": (
        *("rater", "rater_id", "annotator", "annotator_id", "coder", "coder_id"),
        *("judge", "observer", "worker", "worker_id", "assessor", "reviewer"),
    ),
    "grade": ("grade", "rating", "score", "label", "winner"),
    "session": ("session",),
}
"""Names of columns that are recognized, letter case aside."""


def refuse(
    *rules: tuple[object, str], error: type[MasrelError] = ParameterError
) -> None:
    """Raise for the first rule that is broken: whether it is, and the message."""
    for is_broken, sentence in rules:
        if is_broken:
            raise error(sentence)


def check_option(name: str, value: object, options: Collection[object]) -> None:
    """Check that an argument is one of its options."""
    if not isinstance(value, str) or value not in options:
        known = ", ".join(map(str, options))
        raise ParameterError(f"{name}: needs one of {known}, got {shown(value)}")


def shown(value: object) -> str:
    """Return what a message shows of a value: one line, and not a long one."""
    text = "nothing" if value is None else " ".join(f"{value!r}".split())
    return text if len(text) <= 80 else f"{text[:77]}..."


def warn_caller(message: str, category: type[Warning]) -> None:
    """Warn whoever called this package."""
    frame, level = sys._getframe(1), 2
    while frame.f_back and str(frame.f_globals.get("__name__")).startswith("masrel."):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, category, stacklevel=level)


def not_utf8(error: UnicodeDecodeError) -> str:
    """Return where a text is not UTF-8, for a message that begins with its file."""
    line = error.object.count(b"\n", 0, error.start) + 1
    byte = error.object[error.start]
    return f"line {line}: needed UTF-8 text, got the byte {byte:#04x}; save it as UTF-8"


def split_names(text: str) -> list[str]:
    """Return the names between commas; a name may hold one, as ICC(2,1) does."""
    return [name.strip() for name in re.split(r",(?![^(]*\))", text)]


def listed(names: Iterable[str]) -> str:
    """Return names as a message has them: the first of them where they are many."""
    names = list(names)
    more = len(names) - _MAX_LISTED
    return ", ".join(names[:_MAX_LISTED]) + (f" and {more} more" if more > 0 else "")
