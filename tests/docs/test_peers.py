"""What docs/evidence/peers.csv says of masrel is computed; others are not run here."""

import csv
import re
from pathlib import Path

import pytest

from docs.make.peers import (
    DIFFERENCES,
    PAGE,
    QUANTITIES,
    ROWS,
    File,
    digits,
    files,
    ours,
)

with ROWS.open(encoding="utf-8") as _file:
    PRINTED = list(csv.DictReader(_file))
FILES = files()


@pytest.mark.parametrize("file", FILES, ids=[file.name for file in FILES])
def test_our_numbers_are_those_of_today(tmp_path: Path, file: File) -> None:
    path = tmp_path / file.name
    path.write_text(file.csv, encoding="utf-8")
    printed = {r["number"]: r["masrel"] for r in PRINTED if r["file"] == file.name}
    today = {
        f"{question.title}{QUANTITIES[quantity]}": digits(value)
        for question, values in ours(file, path).items()
        for quantity, value in values.items()
    }
    assert len(printed) > 4
    assert printed == {title: today[title] for title in printed}


def test_every_reason_is_on_the_page() -> None:
    text = PAGE.read_text(encoding="utf-8").split("## Why")[1]
    reasons = re.findall(r"^\d+\. (.+)", text, re.MULTILINE)
    named = {n for r in PRINTED for n in re.findall(r"\((\d+)\)", r["other (reason)"])}
    assert named == {str(n) for n in range(1, len(reasons) + 1)}
    assert all(any(of.why in reason for of in DIFFERENCES) for reason in reasons)
