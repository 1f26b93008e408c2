"""What docs/evidence/peers.md says of masrel is computed; others are not run here."""

import re
from pathlib import Path

import pytest

from docs.make.peers import DIFFERENCES, PAGE, QUANTITIES, File, digits, files, ours

TEXT = PAGE.read_text(encoding="utf-8")
FILES = files()


@pytest.mark.parametrize("file", FILES, ids=[file.name for file in FILES])
def test_our_numbers_are_those_of_today(tmp_path: Path, file: File) -> None:
    path = tmp_path / file.name
    path.write_text(file.csv, encoding="utf-8")
    section = TEXT.split(f"## {file.name}\n")[1].split("\n## ")[0]
    printed = dict(re.findall(r"^\| ([^|]+) \| ([^|]+) \|", section, re.MULTILINE))
    today = {
        f"{question.title}{QUANTITIES[quantity]}": digits(value)
        for question, values in ours(file, path).items()
        for quantity, value in values.items()
    }
    assert len(printed) > 4
    assert printed == {title: today[title] for title in printed}


def test_every_reason_is_on_the_page() -> None:
    reasons = re.findall(r"^\d+\. (.+)", TEXT.split("## Why")[1], re.MULTILINE)
    assert len(reasons) == len({*re.findall(r"\[\((\d+)\)\]\(#why\)", TEXT)})
    assert all(any(of.why in reason for of in DIFFERENCES) for reason in reasons)
