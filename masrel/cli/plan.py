"""``masrel plan``: how large a study must be, and what a study can show."""

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli._options import OutputOptions, output_options, write_output
from masrel.cli._paths import InputFile
from masrel.cli._planning_options import PlanningOptions, planning_options
from masrel.cli._progress import Progress, duration_words, progress
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.planning import Plan

_SHORT_S = 2.0  # what takes no longer is not told beforehand


@click.command("plan")
@click.argument("study", required=False, type=InputFile(path_type=Path))
@planning_options
@click.option("--toml", is_flag=True, help="Print lines for a protocol instead.")
@output_options(
    json="Write every number here; - prints them, and nothing else, on stdout.",
    figure="Draw the curve of a grid into this .png, .svg or .pdf.",
    csv="Print every digit as CSV.",
    latex="Print a LaTeX table.",
    sentence="Print a sentence for a protocol instead of the table.",
    quiet="No progress.",
)
def plan(
    study: Path | None, options: PlanningOptions, toml: bool, output: OutputOptions
) -> None:
    """Say how large a study must be, or what STUDY can show.

    With --items or --raters alone, the other is solved for; with both, a study of that
    size is described; with --prices and neither, the cheapest is solved for. Ranges
    make a grid. STUDY is a folder with a protocol: each line of its plan is described
    at its size.
    """
    if study is None:
        options = _with_pilot(options)
    labels, plans = _plans(study, options, is_quiet=output.quiet)
    if toml and len(set(labels)) < len(labels):
        raise ParameterError("--toml: needs one --value for each line of a study")
    if output.figure is not None:
        _check_curve(plans)
    from masrel.tables._planning_tables import (
        planning_curves,
        planning_document,
        planning_sentence,
        planning_table,
        planning_toml,
    )

    lines = labels or (None,) * len(plans)
    write_output(
        output,
        document=lambda: planning_document(plans),
        text=lambda: (
            "\n\n".join(
                planning_toml(one, line=line)
                for one, line in zip(plans, lines, strict=True)
            )
            if toml
            else "\n".join(map(planning_sentence, plans))
            if output.sentence
            else planning_table(plans, labels=labels)
        ),
        figure=lambda: planning_curves(
            plans, power=options.power, assurance=options.assurance
        ),
    )


def _plans(
    study: Path | None, options: PlanningOptions, *, is_quiet: bool
) -> "tuple[tuple[str, ...], tuple[Plan, ...]]":
    # with the lines of a study's plan that they are of
    if study is None and options.is_grid:
        return (), _grid(options, is_quiet=is_quiet)
    options.refuse(("executor", "scheduler", "resume", "n_studies"), "is of grids")
    with progress("planning", "studies", is_quiet=is_quiet) as bar:
        is_solved = study is None and None in (options.items, options.raters)
        unit = " a size" if is_solved else ""
        count = _StudyCount(bar, unit, is_quiet=is_quiet)
        if study is not None:
            from masrel.lab.cli._study_plans import study_plans

            return study_plans(study, options, count.of_plans)
        return (), (_single(options, count),)


class _StudyCount:
    """Studies that are drawn, over simulations of which the number is not known."""

    def __init__(self, bar: Progress, unit: str, *, is_quiet: bool) -> None:
        self._bar, self._unit, self._is_quiet = bar, unit, is_quiet
        self._start = time.monotonic()
        self._n_plans = 1  # that are still to come
        self._before = self._n_drawn = 0  # by earlier simulations, and by this one

    def of_plans(self, n_plans: int) -> "_StudyCount":
        """Expect so many more plans that are alike."""
        self._n_plans = n_plans
        return self

    def __call__(self, n_drawn: int, n_expected: int) -> None:
        if n_drawn <= self._n_drawn:
            self._before, self._n_drawn = self._before + self._n_drawn, 0
        self._bar.expect(self._before + n_expected * self._n_plans)
        self._bar.update(n_drawn - self._n_drawn)
        if self._before == self._n_drawn == 0 and not self._is_quiet:
            self._announce(n_expected * self._n_plans / n_drawn - 1.0)
        self._n_drawn = n_drawn

    def _announce(self, n_times: float) -> None:
        # how long it takes, once the first studies are drawn
        left = (time.monotonic() - self._start) * n_times
        if left > _SHORT_S:
            click.echo(f"planning: {duration_words(left)}{self._unit}", err=True)


def _with_pilot(options: PlanningOptions) -> PlanningOptions:
    # what nobody gave is what a pilot had
    if options.pilot is None:
        return options
    from masrel.planning import pilot
    from masrel.ratings import read_ratings

    target = options.common()["target"]
    file = read_ratings(options.pilot)
    if len(file.parts) != 1:
        raise ParameterError(
            f"--pilot: needs the ratings of one group and session, {options.pilot} has "
            f"{len(file.parts)}"
        )
    made = pilot(
        options.what,
        file.parts[0].ratings,
        target=target,
        weights=options.weights or "identity",
        level=options.common()["level"],
    )
    click.echo(f"pilot {options.pilot}: {made.estimate}", err=True)
    shares = ",".join(map(repr, made.prevalences))
    is_normal = options.what.startswith("icc")
    return replace(
        options,
        value=options.value or [made.estimate.value],
        categories=options.categories or (None if is_normal else made.categories),
        prevalences=options.prevalences or (None if is_normal else shares),
        p_missing=options.p_missing or (0.0 if is_normal else made.p_missing),
    )


def _single(options: PlanningOptions, count: _StudyCount) -> "Plan":
    from masrel.planning import precision, sample_size

    common = {
        **options.common(),
        "value": None if options.value is None else options.value[0],
        "method": options.method,
        "n_items": None if options.items is None else options.items[0],
        "n_raters": None if options.raters is None else options.raters[0],
        "progress": count,
    }
    if options.items is not None and options.raters is not None:
        options.refuse(("max_cost",), "needs --items or --raters to be left out")
        return precision(options.what, **common)
    return sample_size(
        options.what,
        **common,
        power=options.power,
        assurance=options.assurance,
        max_cost=options.max_cost,
    )


def _grid(options: PlanningOptions, *, is_quiet: bool) -> "tuple[Plan, ...]":
    from masrel.planning import plan_grid

    options.refuse(("max_cost",), "is not of a grid, whose rows have their costs")
    if options.method != "auto":
        raise ParameterError(
            f"--method: a grid is by auto, exact where it can be; got {options.method}"
        )
    with progress("planning", "tasks", is_quiet=is_quiet) as bar:

        def step(_done: int, n_tasks: int) -> None:
            bar.expect(n_tasks)
            bar.update(1)

        return plan_grid(
            options.what,
            **options.common(),
            value=options.value,
            power=options.power,
            assurance=options.assurance,
            n_items=options.items,
            n_raters=options.raters,
            n_studies=options.n_studies or 20_000,
            executor=options.executor,
            scheduler=options.scheduler,
            file=options.resume,
            progress=step,
        )


def _check_curve(plans: "tuple[Plan, ...]") -> None:
    if len({one.n_items for one in plans}) < 2 > len({one.n_raters for one in plans}):
        raise ParameterError("--figure: needs several --items or --raters, as 20:60:10")
