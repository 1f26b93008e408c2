"""The tables of the pages say what the code says, and every law has a figure."""

import dataclasses
import re
from math import degrees
from pathlib import Path

import pytest

from docs.make.tone import FIGURES, SCENES
from masrel.lab.elbow import MODELS
from masrel.lab.elbow.tone import ToneModel

PAGES = Path(__file__).parents[4] / "docs/reference/tone"
LAWS = [law for law in MODELS.values() if issubclass(law, ToneModel)]
SHARED = {"range_end", "speed_threshold"}


def page_of(law: type[ToneModel]) -> str:
    name = {"LeadPipe": "lead_pipe"}.get(
        law.__name__, re.sub(r"(?<=[a-z])(?=[A-Z])", "_", law.__name__).lower()
    )
    return (PAGES / f"{name}.md").read_text(encoding="utf-8")


def rows_of(text: str) -> dict[str, tuple[str, str, str]]:
    """Unit, default and origin by parameter; a row may have two of them."""
    rows = {}
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) != 5 or not cells[1].startswith("`"):
            continue
        _, names, unit, defaults, origin = cells
        values = defaults.split(", ")
        for name, value in zip(names.split(", "), values, strict=True):
            rows[name.strip("`")] = (unit, value, origin)
    return rows


@pytest.mark.parametrize("law", LAWS, ids=[law.kind for law in LAWS])
def test_the_table_of_values(law: type[ToneModel]) -> None:
    text = page_of(law)
    assert f'`kind = "{law.kind}"`' in text
    rows = rows_of(text)
    inherited = {entry.name for entry in dataclasses.fields(law.__bases__[0])}
    assert rows.keys() - SHARED == law.quantities().keys() - inherited - SHARED
    for name, (unit, value, origin) in rows.items():
        known, default = law.quantities()[name], getattr(law(), name)
        assert origin.startswith("our choice") == known.is_choice, name
        if default is None:
            assert not value[0].isdigit()
            continue
        if known.unit.startswith("rad"):
            assert unit == known.unit.replace("rad", "deg")
            default = degrees(default)
        else:
            assert unit == (known.unit or "1")
        assert float(value) == pytest.approx(default, abs=1e-9), name


def test_every_law_has_a_figure_in_its_page() -> None:
    drawn = {model.kind for s in SCENES.values() for model in s.models.values()}
    assert drawn == {law.kind for law in LAWS}
    pages = "".join(page.read_text(encoding="utf-8") for page in PAGES.glob("*.md"))
    for name in SCENES:
        assert (FIGURES / f"{name}.png").is_file()
        assert f"](../../figures/{name}.png)" in pages
