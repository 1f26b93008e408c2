"""What a section is made from, and what it is made of."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from masrel.analysis import Analysis
from masrel.protocol import Protocol
from masrel.ratings import InPerson, Ratings
from masrel.report.tables import Table

if TYPE_CHECKING:
    from masrel.report.figures import Drawn

__all__ = ["Drawing", "Material", "Paragraph", "Section", "absent_section"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """Everything a report is made from.

    Attributes
    ----------
    protocol : Protocol
        The study's protocol.
    ratings : Ratings
        The ratings.
    analysis : Analysis
        What was computed from them.
    in_person : InPerson or None
        Grades given in person, whose notes are shown below their table.
    """

    protocol: Protocol
    ratings: Ratings
    analysis: Analysis
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
    """One paragraph of plain text.

    Attributes
    ----------
    text : str
        The text.
    absent : bool
        Whether it says that something asked for is not in the data.
    """

    text: str
    absent: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawing:
    """A figure that is drawn when the document is written, and not before.

    Attributes
    ----------
    name : str
        Name of its files, without extension.
    caption : str
        What it shows, understood alone.
    alt : str
        What a reader who cannot see it needs to know.
    draw : callable
        Draws it.
    """

    name: str
    caption: str
    alt: str
    draw: "Callable[[], Drawn]"


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """One section of the report.

    Attributes
    ----------
    name : str
        Its name in the protocol's ``report.sections``.
    title : str
        Its heading.
    blocks : tuple of Paragraph, Table or Drawing
        Its contents in order.
    """

    name: str
    title: str
    blocks: tuple[Paragraph | Table | Drawing, ...]


def absent_section(name: str, title: str, reason: str | None) -> Section:
    """Make a section whose data are not there, and say why.

    Parameters
    ----------
    name, title : str
        Its name in the protocol's ``report.sections``, and its heading.
    reason : str or None
        Why, as a clause; None when it was not computed.

    Returns
    -------
    Section
        The section with one paragraph.
    """
    why = "this was not computed" if reason is None else reason
    said = Paragraph(text=f"Not in these data: {why}.", absent=True)
    return Section(name=name, title=title, blocks=(said,))
