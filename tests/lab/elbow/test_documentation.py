"""The figures of docs/reference/elbow.md are drawn by the commands below them."""

import re
from pathlib import Path

import pytest

from docs.make.pages import output

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "reference" / "elbow.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"`(masrel joint trace [^`]*--figure (\S+)\.png)`", PAGE)


def test_there_are_figures_to_check() -> None:
    assert len(COMMANDS) == 4


@pytest.mark.parametrize(("command", "name"), COMMANDS, ids=lambda text: text[-20:])
def test_a_figure_is_drawn_by_the_command_below_it(
    command: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    output(command)
    (drawn,) = tmp_path.iterdir()
    assert drawn.name == f"{name}.png"
    assert (DOCS / "figures" / drawn.name).exists()
    assert drawn.stat().st_size > 10_000
