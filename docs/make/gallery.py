"""The pictures of docs/howto/gallery.md, made by the lines of that page itself.

``python -m docs.make.gallery`` runs the page and writes each picture that it shows,
docs/figures/gallery_NAME.png: the figure of pyplot that the blocks above it have made,
or the top of the page that a command has written, in Chromium where that is there.
"""

import re
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
from playwright.sync_api import sync_playwright

from docs.make.evidence import FIGURES
from docs.make.pages import ROOT, read, run
from tests.lab.serve.browser.conftest import CHROMIUM, FLAGS

PAGE = ROOT / "docs" / "howto" / "gallery.md"
SIZE = {"width": 1060, "height": 985}  # of the window, as wide as what is read


def main() -> None:
    """Run the page, and write what it shows."""
    text = PAGE.read_text(encoding="utf-8")
    # with those that take too long for a test of the page
    blocks = [replace(block, marker="") for block in read(text, PAGE.name)]
    lines = text.splitlines()
    for block, _ in zip(blocks, run(blocks), strict=True):
        below = "\n".join(lines[block.number + len(block.lines) :])
        name = re.search(r"figures/(gallery_\w+\.png)", below)
        if plt.get_fignums() and name:
            plt.savefig(FIGURES / name[1], dpi=150, metadata={"Software": None})
            plt.close()
        elif name and any("--html page.html" in line for line in block.lines):
            photograph(Path("page.html"), FIGURES / name[1])


def photograph(page: Path, path: Path) -> None:
    """Write what is seen of a page when it is opened, where there is Chromium."""
    if CHROMIUM is None:
        return
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        window = browser.new_page(viewport=SIZE, color_scheme="light")
        window.goto(page.absolute().as_uri())
        window.screenshot(path=path)
        browser.close()


if __name__ == "__main__":
    main()
