"""Fonts for the letters of any script, beside the one that figures are set in."""

import os
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from matplotlib import font_manager
from matplotlib.artist import Artist
from matplotlib.font_manager import get_font
from matplotlib.text import Text

from masrel.errors import MissingLettersWarning

_OWN = "DejaVu Sans"  # ships with matplotlib


def complete_fonts(artist: Artist) -> None:
    """Give all texts of a figure fonts that have their letters, where there are any."""
    texts = [text for text in artist.findobj(Text) if isinstance(text, Text)]
    lacking = {ord(letter) for text in texts for letter in text.get_text()} - {10}
    families = []
    for name, file in _fonts():
        if not lacking:
            break
        if covered := lacking & _letters(file):
            families.append(name)
            lacking -= covered
    if families != [_OWN]:
        for text in texts:
            text.set_fontfamily([_OWN, *families[1:]])
    if lacking:
        warnings.warn(MissingLettersWarning(map(chr, lacking)), stacklevel=4)


def _fonts() -> Iterator[tuple[str, str]]:
    # names and files: our own, the one that the user gives, and those of the system
    yield _OWN, font_manager.findfont(_OWN)
    if chosen := os.environ.get("MASREL_FONT"):
        if Path(chosen).is_file():
            font_manager.fontManager.addfont(chosen)
            chosen = get_font(chosen).family_name
        yield chosen, font_manager.findfont(chosen)
    entries = {of.fname: of.name for of in font_manager.fontManager.ttflist}
    # the last resort has a box for every letter
    real = {file: name for file, name in entries.items() if "Last" not in name}
    yield from sorted((name, file) for file, name in real.items())


@cache
def _letters(file: str) -> frozenset[int]:
    font = get_font(file)
    return frozenset(font.get_charmap()) if font.scalable else frozenset()
