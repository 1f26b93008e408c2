"""List lines with turns of phrase that docs/development/english.md advises against.

``python -m docs.make.phrases [FILE ...]`` reads the files named, or the README, all
pages and the strings of masrel. Run it by hand: not every line it lists is wrong.
"""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from docs.make.pages import ROOT

LIST = ROOT / "docs/development/english.md"
CODE = re.compile(r"^```.*?^```|<!--.*?-->", re.MULTILINE | re.DOTALL)


def turns() -> list[tuple[re.Pattern[str], str]]:
    """Return the rows of the table, with a bar in place of an escaped one."""
    rows = re.findall(r"^\| `(.+)` \| (.+) \|$", LIST.read_text("utf-8"), re.MULTILINE)
    return [(re.compile(rf"\b{p}".replace(r"\|", "|")), better) for p, better in rows]


def lines(path: Path) -> Iterator[tuple[int, str]]:
    """Yield what a person reads, with the number of each line."""
    text = path.read_text("utf-8")
    if path.suffix == ".py":
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield from enumerate(node.value.splitlines(), node.lineno)
    else:
        blank = CODE.sub(lambda match: "\n" * match[0].count("\n"), text)
        yield from enumerate(blank.splitlines(), 1)


def main() -> None:
    """Print each line with what may be better, and their number."""
    kinds = "README.md", "docs/**/*.md", "masrel/**/*.py"
    pages = {page for kind in kinds for page in ROOT.glob(kind)} - {LIST}
    known = turns()
    found = [
        f"{path}:{number}: {line.strip()}  -> {better}"
        for path in ([*map(Path, sys.argv[1:])] or sorted(pages))
        for number, line in lines(path)
        for pattern, better in known
        if pattern.search(line)
    ]
    print(*found, f"{len(found)} lines", sep="\n")


if __name__ == "__main__":
    main()
