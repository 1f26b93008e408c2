"""The figures of tone: every law has one, and each is drawn in the same bytes."""

from pathlib import Path

from docs.make.tone import FIGURES, SCENES
from masrel.lab.elbow import MODELS
from masrel.lab.elbow.tone import ToneModel

PAGES = Path(FIGURES).parent / "tone"


def test_every_law_has_a_figure_in_its_page() -> None:
    drawn = {model.kind for s in SCENES.values() for model in s.models.values()}
    assert drawn == {k for k, law in MODELS.items() if issubclass(law, ToneModel)}
    pages = "".join(page.read_text(encoding="utf-8") for page in PAGES.glob("*.md"))
    for name in SCENES:
        assert (FIGURES / f"{name}.png").is_file()
        assert f"](../figures/{name}.png)" in pages
