"""The pages that a report is written as.

In: a document whose figures are drawn. Out: the bytes of a page, in every format that
`WRITERS` names; LaTeX and documents of a word processor by pandoc from the Markdown.
"""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Literal

from masrel._files import write_file
from masrel.errors import ParameterError
from masrel.pages._sections import Document, html_page, template_environment
from masrel.tables._latex import in_math
from masrel.tables._tables import Column, page_cells

TEMPLATES = Path(__file__).with_name("templates")


def _markdown(document: Document, form: Literal["latex", "docx"] | None) -> str:
    # form: what pandoc makes of it, whose captions it then has
    environment = template_environment(TEMPLATES)
    escape = as_markdown
    if form == "latex":  # whose own letters have no Greek ones

        def escape(text: str) -> str:
            return in_math(as_markdown(text).replace("$", r"\$"))

    environment.filters |= {"md": escape, "cells": page_cells, "rule": _rule}
    return environment.get_template("report.md").render(document=document, form=form)


def _as_document(form: Literal["latex", "docx"], document: Document) -> bytes:
    every = (*document.sections, *document.supplement)
    blocks = [block for section in every for block in section.blocks]
    pictures = {
        block.files["png"]: block.pictures["png"] for block in blocks if block.files
    }
    return converted(_markdown(document, form), form, pictures=pictures)


WRITERS: dict[str, tuple[str, Callable[[Document], bytes]]] = {
    "html": ("report.html", lambda of: html_page(of).encode()),
    "markdown": ("report.md", lambda of: _markdown(of, None).encode()),
    "latex": ("report.tex", partial(_as_document, "latex")),
    "docx": ("report.docx", partial(_as_document, "docx")),
}
"""The formats of pages by name, in the order in which they are written: a file's name
in the report's folder, and what writes it."""

CONVERTED = frozenset(("latex", "docx"))
"""Formats that pandoc makes."""


def _rule(columns: Sequence[Column], rows: Sequence[Sequence[str]]) -> str:
    # of a table: how columns are set, and how wide they are to each other
    lines = []
    for column, *cells in zip(columns, *rows, strict=True):
        words = (word for text in (column.heading, *cells) for word in text.split())
        widest = min(max(map(len, cells), default=0), _WIDEST)
        line = "-" * max(widest, *map(len, words), 3)
        colons = {"left": (":", ""), "right": ("", ":"), "center": (":", ":")}
        lines.append(line.join(colons[column.align]))
    return f"|{'|'.join(lines)}|"


_WIDEST = 30  # letters of a column of text that may be broken into lines

_MARKDOWN_ESCAPES = str.maketrans({letter: f"\\{letter}" for letter in "\\`*_|<>[]#"})


def as_markdown(text: str) -> str:
    """Return a text as one line of Markdown that shows it as it is."""
    return " ".join(text.translate(_MARKDOWN_ESCAPES).split())


_FIRST_DAY = "315532800"  # of 1980, the earliest that a zip can say
_SMALL = (  # letters of tables; figures stand where they are told of
    r"header-includes=\usepackage{float}\floatplacement{figure}{H}"
    r"\AtBeginEnvironment{longtable}{\footnotesize"
    r"\setlength{\tabcolsep}{3pt}}"
)
_OPTIONS = {
    "latex": (
        *("--from=markdown-smart-citations", "--toc"),
        *("-V", "papersize=a4", "-V", "geometry=margin=20mm", "-V", _SMALL),
    ),
    "docx": ("--from=markdown-smart-citations-tex_math_dollars",),
}


@cache
def _pandoc() -> str:
    """Return the path of pandoc, or refuse to continue without it."""
    try:
        import pypandoc

        return str(pypandoc.get_pandoc_path())
    except (ImportError, OSError):
        if path := shutil.which("pandoc"):
            return path
    raise ParameterError(
        "latex and docx: need pandoc; install it with: pip install 'masrel[docx]'"
    )


def pandoc_version() -> str:
    """Return the version of pandoc, or refuse to continue without it."""
    shown = subprocess.run([_pandoc(), "--version"], capture_output=True, check=True)
    return shown.stdout.decode().split()[1]


def converted(
    markdown: str,
    form: Literal["latex", "docx"],
    *,
    pictures: Mapping[str, bytes],
) -> bytes:
    """Return Markdown in another form; pictures by their paths from its folder."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        out = folder / f"report.{form}"
        for path, data in pictures.items():
            (folder / path).parent.mkdir(exist_ok=True)
            write_file(folder / path, data)
        done = subprocess.run(
            [
                *(_pandoc(), "--to", form, "--standalone", "--output", str(out)),
                "--data-dir=.",  # templates of the user's change nothing
                *("--shift-heading-level-by=-1", *_OPTIONS[form]),
            ],
            input=markdown.encode(),
            cwd=folder,
            env={**os.environ, "SOURCE_DATE_EPOCH": _FIRST_DAY},
            check=False,
            capture_output=True,
        )
        if done.returncode:
            why = " ".join(done.stderr.decode(errors="replace").split())
            raise ParameterError(
                f"{form}: needs a pandoc that makes it, 3.0 or newer; {_pandoc()} "
                f"ended with: {why}"
            )
        return out.read_bytes()
