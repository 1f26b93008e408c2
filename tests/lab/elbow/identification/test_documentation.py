"""The table of coverage of docs/identification.md is within what it claims."""

import re
from pathlib import Path

PAGE = (Path(__file__).parents[4] / "docs/identification.md").read_text(
    encoding="utf-8"
)


def test_the_table_of_coverage_is_within_what_it_claims() -> None:
    # the slow test measures two of its rows; the page must not say otherwise
    rows = re.findall(r"^\| HM\d, .*?\|((?: [\d.]+ \|)+)$", PAGE, flags=re.MULTILINE)
    assert len(rows) == 5
    shares = [float(value) for row in rows for value in row.strip(" |").split("|")]
    assert len(shares) == 40
    assert all(90.0 <= share <= 98.0 for share in shares)
