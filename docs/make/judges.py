"""The figures of pages on judges: two of docs/howto, and the tutorial.

``python -m docs.make.judges`` draws them.
"""

import contextlib
import subprocess
import sys
import tempfile

from docs.make.pages import ROOT, read

FIGURES = ROOT / "docs" / "figures"
CALLS = {
    "judges_humans.png": (
        *("answers.csv", "--judge", "large", "--judge", "small"),
        *("--annotators", "skilled", "--target", "items"),
    ),
    "judges_corrected.png": ("monitor.csv", "--judge", "large", "--rate", "pass"),
    "judges_strengths.png": ("preferences.csv", "--order", "first"),
    "tutorial_judge.png": (
        *(str(ROOT / "docs/tutorials/replies.csv"), "--judge", "llm"),
        *("--annotators", "skilled", "--target", "items", "--item-name", "replies"),
    ),
}


def draw() -> None:
    """Write the files of the blocks of Python, and draw what is shown of them."""
    pages = (ROOT / f"docs/howto/{name}.md" for name in ("judges", "preferences"))
    blocks = (of for page in pages for of in read(page.read_text("utf-8")))
    blocks = (of for of in blocks if of.language == "python")
    lines = ["\n".join(of.lines) for of in blocks if ".csv" in "".join(of.lines)]
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for made in lines:
            exec(made, {})
        for name, call in CALLS.items():
            command = [sys.executable, "-m", "masrel", "judge", *call]
            subprocess.run([*command, "--figure", FIGURES / name], check=True)


if __name__ == "__main__":
    draw()
