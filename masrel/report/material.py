"""What a section is made from, and what it is made of."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from masrel.analysis import Analysis
from masrel.protocol import Protocol
from masrel.ratings import InPerson, Ratings
from masrel.report._tables import Table

if TYPE_CHECKING:
    from masrel.report.figures import Drawn

__all__ = ["Drawing", "Material", "Paragraph", "Section", "absent_section"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """Everything a report is made from."""

    protocol: Protocol  # the study's protocol
    ratings: Ratings  # the ratings
    analysis: Analysis  # what was computed from them
    # grades given in person, whose notes are shown below their table
    in_person: InPerson | None = None

    @property
    def data(self) -> str:
        """Where the data come from, in one word; more than one joined by "+"."""
        sources = sorted(set(self.ratings.table["source"]))
        if self.ratings.simulated and "simulated" not in sources:
            sources.append("simulated")
        return "+".join(sources) or "foreign"

    @property
    def stamp(self) -> str:
        """The line every figure carries."""
        if self.ratings.simulated:
            return "SIMULATED DATA"
        if self.data == "published":
            return f"Published data: {self.protocol.study.source}".rstrip(": ")
        return ""

    @property
    def trace_stamp(self) -> str:
        """The line a figure of reconstructed traces carries."""
        if self.ratings.simulated:
            return self.stamp
        if self.data == "published":
            source = self.protocol.study.source
            return (
                "Model reconstruction at published mean speeds, not a measurement: "
                f"{source}"
            ).rstrip(": ")
        return "Model reconstruction at recorded mean speeds, not a measurement"

    @property
    def sessions(self) -> tuple[str, ...]:
        """Sessions that have ratings, in the protocol's order."""
        present = set(self.ratings.table["session"])
        declared = (session.id for session in self.protocol.sessions)
        return tuple(session for session in declared if session in present)

    @property
    def raters(self) -> tuple[str, ...]:
        """Raters that have ratings, in the protocol's order."""
        present = set(self.ratings.table["rater"])
        return tuple(r.id for r in self.protocol.raters if r.id in present)


@dataclass(frozen=True, slots=True, kw_only=True)
class Paragraph:
    """One paragraph of plain text."""

    text: str  # the text
    absent: bool = False  # whether it says that something asked for is not in the data


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawing:
    """A figure that is drawn when the document is written, and not before."""

    name: str  # name of its files, without extension
    caption: str  # what it shows, understood alone
    alt: str  # what a reader who cannot see it needs to know
    draw: "Callable[[], Drawn]"  # draws it


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """One section of the report."""

    name: str  # its name in the protocol's ``report.sections``
    title: str  # its heading
    blocks: tuple[Paragraph | Table | Drawing, ...]  # its contents in order


def absent_section(name: str, title: str, reason: str | None) -> Section:
    """Make a section whose data are not there, and say why."""
    why = "this was not computed" if reason is None else reason
    said = Paragraph(text=f"Not in these data: {why}.", absent=True)
    return Section(name=name, title=title, blocks=(said,))
