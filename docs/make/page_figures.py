"""The pictures that commands on pages draw: ``python -m docs.make.page_figures``."""

import shutil
import tempfile
from pathlib import Path

from docs.make.evidence import DOCS, FIGURES
from docs.make.pages import renewed

COEFFICIENTS = "reference/coefficients"
PICTURES = {
    "howto/judges": {"judges": "judges_humans", "rates": "judges_corrected"},
    "howto/preferences": {"strengths": "judges_strengths"},
    "tutorials/judge": {"judge": "tutorial_judge"},
    f"{COEFFICIENTS}/generalizability": {"gstudy": "gstudy"},
    f"{COEFFICIENTS}/limits_with_repeats": {"limits": "limits_with_repeats"},
    f"{COEFFICIENTS}/spans": {"spans": "spans"},
}
"""Names that a page's commands give to pictures, and those of docs/figures."""


def main() -> None:
    """Run each page, and keep its pictures."""
    for page, pictures in PICTURES.items():
        text = (DOCS / f"{page}.md").read_text("utf-8")
        with tempfile.TemporaryDirectory() as folder:
            kept = Path(folder, "kept")
            renewed(text, page, kept)
            for made, name in pictures.items():
                shutil.copyfile(kept / f"{made}.png", FIGURES / f"{name}.png")


if __name__ == "__main__":
    main()
