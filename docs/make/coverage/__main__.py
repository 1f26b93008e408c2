"""How often intervals of Fleiss' kappa hold what they ask for, cell by cell.

``python -m docs.make.coverage`` writes ``docs/coverage.md`` and its figure.
"""

import argparse
from collections.abc import Iterable, Sequence
from pathlib import Path

from tqdm import tqdm

from docs.make.coverage.careless import count_careless
from docs.make.coverage.figure import draw
from docs.make.coverage.page import Rare, page
from docs.make.coverage.rare import (
    RareCell,
    RareQuestion,
    checked_on,
    chosen_on,
    count_rare,
)
from docs.make.coverage.simulate import DESIGNS, OTHERS, Cell, all_cells, simulate
from docs.make.coverage.studies import Design

DOCS = Path(__file__).parents[2]
SIZE, QUICK = 4_000, 200
RARE = 1.25  # times as many studies where categories are rare
FEWER = 4  # by how much cells of other designs have fewer studies


def main() -> None:
    """Simulate, and write the page and the figure."""
    parser = argparse.ArgumentParser(description="Coverage of intervals of kappa.")
    parser.add_argument(
        "--quick", action="store_true", help=f"{QUICK} studies a cell, not {SIZE}"
    )
    parser.add_argument("--quiet", action="store_true", help="say nothing")
    parser.add_argument("--into", type=Path, default=DOCS, help="folder of the page")
    options = parser.parse_args()
    size = QUICK if options.quick else SIZE
    cells = _counted(DESIGNS, size, quiet=options.quiet)
    others = _counted(OTHERS, size // FEWER, quiet=options.quiet)
    rare = Rare(
        chosen=_rare(chosen_on(), round(RARE * size), quiet=options.quiet),
        checked=_rare(checked_on(), round(RARE * size), quiet=options.quiet),
        careless=list(count_careless(size // FEWER)),
    )
    (options.into / "figures").mkdir(parents=True, exist_ok=True)
    draw(cells, options.into / "figures" / "coverage.png")
    (options.into / "coverage.md").write_text(
        page(cells, others, rare), encoding="utf-8"
    )
    if not options.quiet:
        print(f"wrote {options.into / 'coverage.md'}")


def _counted(designs: Sequence[Design], size: int, *, quiet: bool) -> list[Cell]:
    questions = tqdm(list(all_cells(designs)), disable=quiet, unit="cell")
    return [simulate(*question, size) for question in questions]


def _rare(
    questions: Iterable[RareQuestion], size: int, *, quiet: bool
) -> list[RareCell]:
    shown = tqdm(list(questions), disable=quiet, unit="population")
    return [cell for question in shown for cell in count_rare(question, size)]


if __name__ == "__main__":
    main()
