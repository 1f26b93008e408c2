"""The two pages of a report, from one list of placed blocks."""

import html
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

from masrel.report._tables import Column, Table
from masrel.report.material import Drawing, Material, Paragraph

__all__ = ["Placed", "PlacedSection", "render_pages"]

BANNER = "SIMULATED DATA – no person gave these grades"

# Symbols of the model as they are written in plain text: an index after "_".
_SYMBOL = re.compile(r"(?<!\w)(ΔT|k|ν|θ|p)_(peak|post|th|L|start|end|o|e)(?!\w)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Placed:
    """A block with its number."""

    kind: Literal["paragraph", "table", "figure"]  # what it is
    number: int  # which of its kind, from 1
    content: Paragraph | Table | Drawing  # the block
    # columns, rows: of a table, as they are shown
    columns: list[Column]
    rows: list[list[str]]
    uri: str = ""  # A figure's picture, to be held inside the page


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedSection:
    """A section with its numbered blocks."""

    # name, title: its name in the protocol, and its heading
    name: str
    title: str
    blocks: tuple[Placed, ...]  # its contents in order


def render_pages(
    material: Material, sections: tuple[PlacedSection, ...]
) -> dict[str, str]:
    """Write out the pages."""
    context = _context(material, sections)
    environment = _environment()
    names = ("report.html", "report.md")
    return {name: environment.get_template(name).render(context) for name in names}


def _context(
    material: Material, sections: tuple[PlacedSection, ...]
) -> dict[str, object]:
    analysis, study = material.analysis, material.protocol.study
    style = Path(__file__).with_name("templates") / "report.css"
    return {
        "title": material.protocol.report.title or study.title,
        "simulated": material.ratings.simulated,
        "banner": BANNER,
        "provenance": _provenance(material),
        "sections": sections,
        "inputs": [
            (f"SHA-256 of the {name.removesuffix('_sha256').replace('_', '-')}", digest)
            for name, digest in analysis.inputs.items()
        ],
        "style": style.read_text(encoding="utf-8"),
        "version": analysis.masrel_version,
    }


def _provenance(material: Material) -> str:
    if material.ratings.simulated:
        return (
            "The grades and speeds in this report are simulated. They show that the "
            "study runs; they say nothing about people or about the models."
        )
    source = material.protocol.study.source
    if material.data == "published":
        return f"Published grades and speeds: {source}".rstrip(": ")
    return f"Study {material.protocol.study.id}, {material.data} ratings."


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("masrel.report"),
        autoescape=select_autoescape(enabled_extensions=("html",)),
        undefined=StrictUndefined,
        keep_trailing_newline=True,
    )
    environment.filters["md"] = _markdown
    environment.filters["symbols"] = _symbols
    return environment


def _symbols(text: str) -> str:
    # Escaped first; what is added after that is ours, and so safe in a template.
    return _SYMBOL.sub(r"\1<sub>\2</sub>", html.escape(text))


def _markdown(text: str) -> str:
    for letter in "\\`*_|<>[]#":
        text = text.replace(letter, f"\\{letter}")
    return " ".join(text.split())
