"""A page of several parts, each written by a command of its own."""

from collections.abc import Sequence
from pathlib import Path

__all__ = ["write_part"]


def write_part(path: Path, name: str, lines: Sequence[str]) -> None:
    """Replace one part of a page, or add it at the end; the others stay."""
    first, last = f"<!-- {name} -->", f"<!-- end of {name} -->"
    text = "\n".join([first, "", *lines, "", last])
    page = path.read_text(encoding="utf-8") if path.exists() else ""
    if first in page:
        before, rest = page.split(first, 1)
        page = before + text + rest.split(last, 1)[1]
    else:
        page = f"{page.rstrip()}\n\n{text}\n".lstrip()
    path.write_text(page, encoding="utf-8")
