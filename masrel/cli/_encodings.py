"""Screens and files that cannot show every letter, such as Windows' cp1252."""

import codecs
import io
import sys
import unicodedata

_NAME = "masrel"

_SIGNS = {
    "−": "-",
    "–": "-",
    "—": "-",
    "·": ".",
    "×": "x",
    "±": "+-",
    "²": "^2",
    "³": "^3",
    "°": "deg",
    "∞": "inf",
    "≤": "<=",
    "≥": ">=",
    "√": "sqrt",
    "…": "...",
    "‘": "'",
    "’": "'",
    "“": '"',
    "”": '"',
}


def accept_any_text() -> None:
    """Let stdout and stderr write what they cannot encode in other letters."""
    codecs.register_error(_NAME, _in_other_letters)
    for stream in (sys.stdout, sys.stderr):
        # One that somebody has told what to do with such letters goes on doing it.
        if isinstance(stream, io.TextIOWrapper) and stream.errors in _DEFAULTS:
            stream.reconfigure(errors=_NAME)


_DEFAULTS = ("strict", "surrogateescape", "backslashreplace")


def is_encodable(text: str) -> bool:
    """Return whether stdout can write a text as it is."""
    try:
        text.encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:
        return False
    return True


def _in_other_letters(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    letters = error.object[error.start : error.end]
    return "".join(map(_spelled, letters)), error.end


def _spelled(letter: str) -> str:
    # A name of somebody stays what it is, in escapes.
    if letter in _SIGNS:
        return _SIGNS[letter]
    words = unicodedata.name(letter, "").split()
    if words[:1] == ["GREEK"] and words[2:3] == ["LETTER"] and len(words) == 4:
        return words[3].lower() if words[1] == "SMALL" else words[3].capitalize()
    return letter.encode("ascii", "backslashreplace").decode("ascii")
