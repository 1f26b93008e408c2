"""The document that a report is: sections of numbered blocks."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from masrel.lab.report._material import Content, Drawing, Listing, Paragraph
from masrel.tables._tables import Table

_KINDS = {
    Paragraph: "paragraph",
    Table: "table",
    Drawing: "figure",
    Listing: "listing",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A part of a section, with its number among those of its kind."""

    number: int
    content: Content
    # of a figure: its bytes, and its file from the report's folder, by form (png, svg)
    pictures: Mapping[str, bytes] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)

    @property
    def kind(self) -> str:
        """What it is: paragraph, table, figure or listing."""
        return _KINDS[type(self.content)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Chapter:
    """A section of the report as it is shown."""

    name: str  # its name in the protocol's ``report.sections``
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Document:
    """All that a page of a report says."""

    title: str
    tag: str  # what stands before a caption where data are simulated
    banner: str  # what the page says in large letters, if anything
    provenance: str  # the sentence at its head
    result: str  # the first paragraph: what the study came to
    sections: tuple[Chapter, ...]
    inputs: tuple[tuple[str, str], ...]  # what it was made from, and the hash of that
    version: str  # of masrel
