"""The words of the rater's page, in the language of a study."""

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

_FOLDER = Path(__file__).parent / "words"


@cache
def words_in(language: str) -> dict[str, Any]:
    """Return the words by what they are for; ``meanings`` by scale and grade."""
    text = (_FOLDER / f"{language}.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)
