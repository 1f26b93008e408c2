"""How often 95 % intervals hold what they ask for, study by study.

``python -m docs.make.coverage NAME`` draws the study of that name, writes
``docs/evidence/NAME.csv``, and renews the tables and figures that pages have of it;
with ``--page`` only these, from the rows there are.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace

import pandas as pd

from docs.make.coverage import (
    gstudies,
    icc,
    judge_rates,
    kappas,
    kappas_page,
    learning_curve,
    limits,
    resampling,
    rules,
)
from docs.make.coverage.study import Cell, run
from docs.make.evidence import EVIDENCE, write_rows

STUDIES: dict[
    str, tuple[Callable[[], Sequence[Cell]], Callable[[pd.DataFrame], None] | None]
] = {
    "coverage": (kappas.cells, kappas_page.write_page),
    "coverage_defaults": (rules.deciding, kappas_page.write_page),
    "coverage_held_out": (rules.held_out, kappas_page.write_page),
    "icc_coverage": (icc.cells, icc.write_page),
    "judges_rates": (judge_rates.cells, judge_rates.write_figure),
    "resampling": (resampling.cells, resampling.write_pages),
    "limits_coverage": (limits.cells, None),
    "training_coverage": (learning_curve.cells, learning_curve.write_page),
    "gstudy_coverage": (gstudies.cells, gstudies.write_page),
}
"""Cells of each study, and what its rows are shown as."""


def main() -> None:
    """Draw, count, and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="+", choices=STUDIES, metavar="NAME")
    parser.add_argument("--studies", type=int, help="in a cell, at most")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--page", action="store_true", help="from the rows there are")
    parser.add_argument("--quiet", action="store_true", help="say nothing")
    options = parser.parse_args()
    for name in options.names:
        cells, show = STUDIES[name]
        if not options.page:
            drawn = [
                replace(
                    of, n_studies=min(of.n_studies, options.studies or of.n_studies)
                )
                for of in cells()
            ]
            rows = run(drawn, processes=options.processes, quiet=options.quiet)
            write_rows(name, rows)
        if show:
            show(pd.read_csv(EVIDENCE / f"{name}.csv"))


if __name__ == "__main__":
    main()
