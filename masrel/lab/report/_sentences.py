"""The words of the first paragraph and of the methods: one file has them all."""

import tomllib
from functools import cache
from pathlib import Path

_FILE = Path(__file__).with_name("templates") / "sentences.toml"


@cache
def sentences() -> dict[str, dict[str, str]]:
    """Return every sentence by its group and name, with its words in braces."""
    return tomllib.loads(_FILE.read_text(encoding="utf-8"))


def sentence(group: str, name: str, **words: object) -> str:
    """Return a sentence with its words in braces replaced."""
    return sentences()[group][name].format_map(words)
