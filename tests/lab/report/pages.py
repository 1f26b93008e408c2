"""Reports made for tests, and their pages taken apart."""

import re
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import msgspec

from masrel.lab.analysis import analyze
from masrel.lab.protocol import Protocol
from masrel.lab.ratings import Ratings, ratings_from_rows
from masrel.lab.report._document import ReportFiles, write_report
from masrel.scales import MODIFIED_ASHWORTH
from tests.files import table_of
from tests.lab.analysis.studies import in_person, plan, protocol_with, table_v

ALL = (
    "design",
    "sample-size",
    "grades",
    "agreement",
    "test-retest",
    "categories",
    "intended",
    "confusion",
    "in-person",
    "order",
    "speeds",
    "traces",
    "questionnaires",
    "claims",
    "methods",
)

AGAIN = plan(
    id="again",
    kind="test-retest",
    coefficient="stratified_kappa",
    sessions=["test", "retest"],
    target="items",
)

HOSTILE = '<script>alert("x")</script> & co. *a* _b_ | `c` [d](e) </style>'


def published_report(folder: Path, *sections: str) -> ReportFiles:
    """The report of Table V, with a line the data do not hold."""
    lines = (
        plan(id="kappa", interval="jackknife"),
        plan(id="percent", coefficient="percent_agreement"),
        plan(id="lost", models="dummy"),
        AGAIN,
    )
    return _report(protocol_with(*lines, sections=sections or ALL), table_v(), folder)


def simulated_ratings() -> Ratings:
    """Two raters, two sessions, two models, one grade missing; all simulated."""
    grades = {
        ("test", "R1"): ("1", "1+"),
        ("test", "R2"): ("1", None),
        ("retest", "R1"): ("1", "2"),
        ("retest", "R2"): ("0", "1+"),
    }
    rows = [
        {
            "session": session,
            "rater": rater,
            "model": f"HM{number}",
            "grade": grade,
            "mean_speed_deg_s": 70.0 + 10 * number,
            "source": "simulated",
        }
        for (session, rater), own in grades.items()
        for number, grade in enumerate(own, start=1)
    ]
    return ratings_from_rows(rows, MODIFIED_ASHWORTH)


def simulated_report(folder: Path) -> ReportFiles:
    """A report of simulated ratings whose every text field is hostile."""
    protocol = protocol_with(
        plan(id="kappa"),
        AGAIN,
        sections=ALL,
    )
    replace = msgspec.structs.replace
    protocol = replace(
        protocol,
        study=replace(protocol.study, title=HOSTILE, notes=HOSTILE, source=HOSTILE),
        report=replace(protocol.report, title=HOSTILE),
        scale=replace(protocol.scale, name=HOSTILE),
        sessions=tuple(replace(s, note=HOSTILE) for s in protocol.sessions),
    )
    return _report(protocol, simulated_ratings(), folder)


def _report(protocol: Protocol, ratings: Ratings, folder: Path) -> ReportFiles:
    own = None if ratings.simulated else in_person()
    analysis = analyze(protocol, ratings, in_person=own)
    return write_report(protocol, ratings, analysis, folder, in_person=own)


def written(
    folder: Path, protocol: Protocol, rows: Ratings, excluded: Any = (), **of: Any
) -> ReportFiles:
    analysis = analyze(protocol, rows, excluded=excluded)
    return write_report(protocol, rows, analysis, folder, **of)


def page(files: ReportFiles) -> str:
    return re.sub(r"\\(.)", r"\1", files.markdown.read_text(encoding="utf-8"))


def rows_of(files: ReportFiles, name: str) -> list[dict[str, str]]:
    (path,) = [path for path in files.tables if path.stem == name]
    return table_of(path)


@dataclass
class Page(HTMLParser):
    """What a browser would find in a page."""

    tables: list[list[list[str]]] = field(default_factory=list)
    captions: list[str] = field(default_factory=list)
    headings: list[str] = field(default_factory=list)
    images: list[dict[str, str]] = field(default_factory=list)
    links: list[str] = field(default_factory=list)
    tags: set[str] = field(default_factory=set)
    _into: list[str] | None = None

    def __post_init__(self) -> None:
        super().__init__(convert_charrefs=True)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        known = {name: value or "" for name, value in attrs}
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("th", "td"):
            self._into = self.tables[-1][-1]
            self._into.append("")
        elif tag in ("caption", "figcaption", "h1", "h2"):
            self._into = self.captions if "caption" in tag else self.headings
            self._into.append("")
        elif known.get("role") == "img":
            self.images.append(known)
        self.links += [
            v for n, v in known.items() if n in ("href", "src", "xlink:href")
        ]

    def handle_endtag(self, tag: str) -> None:
        if tag in ("th", "td", "caption", "figcaption", "h1", "h2"):
            self._into = None

    def handle_data(self, data: str) -> None:
        if self._into is not None:
            self._into[-1] += data


def page_of(files: ReportFiles) -> Page:
    page = Page()
    page.feed(files.html.read_text(encoding="utf-8"))
    return page


def markdown_tables(text: str) -> list[list[list[str]]]:
    """Tables of a Markdown page: rows of cells, escapes undone."""
    found = re.findall(r"(?:^\|.*\n)+", text, re.M)
    return [
        [
            [re.sub(r"\\(.)", r"\1", cell).strip() for cell in _BAR.split(line[1:-1])]
            for line in table.splitlines()
            if not line.startswith(("|:", "|-"))
        ]
        for table in found
    ]


_BAR = re.compile(r"(?<!\\)\|")
