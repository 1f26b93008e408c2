"""Pages of evidence: prose by hand, with parts and tables of rows by programs."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

DOCS = Path(__file__).parents[1]
EVIDENCE, FIGURES = DOCS / "evidence", DOCS / "figures"


def write_rows(name: str, rows: Sequence[Mapping[str, object]]) -> None:
    """Write rows beside the pages, as ``NAME.csv``; long floats have four digits."""
    path = EVIDENCE / f"{name}.csv"
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: cell(x) for key, x in row.items()} for row in rows)


def cell(value: object) -> object:
    """Return what is written of a value."""
    is_long = isinstance(value, float) and len(repr(value)) > 8
    return f"{value:.4g}" if is_long else value


def table(
    head: Sequence[str], rows: Sequence[Sequence[object]], n_text: int = 1
) -> str:
    """Return a table in Markdown, its first columns to the left."""
    bar = ["---"] * n_text + ["---:"] * (len(head) - n_text)
    return "\n".join(f"| {' | '.join(map(str, row))} |" for row in (head, bar, *rows))


def with_part(page: str, name: str, text: str) -> str:
    """Return a page with the text between its marks of a part."""
    first, last = f"<!-- {name} -->\n", f"\n<!-- end of {name} -->"
    before, _, rest = page.partition(first)
    return f"{before}{first}\n{text}\n{last}{rest.partition(last)[2]}"


def write_part(path: Path, name: str, text: str) -> None:
    """Replace a part of a page; all else stays."""
    page = path.read_text(encoding="utf-8")
    path.write_text(with_part(page, name, text), encoding="utf-8")
