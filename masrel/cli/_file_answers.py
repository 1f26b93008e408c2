"""What the commands that estimate agreement have in common: options, and answers."""

import shlex
import shutil
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import click

from masrel._input import refuse, split_names
from masrel.analysis._file_estimates import USUAL, Questions
from masrel.cli._options import (
    GroupedHelp,
    OutputOptions,
    call_text,
    echo_notes,
    grouped,
    level_option,
    output_options,
    write_output,
)
from masrel.cli._paths import InputFile
from masrel.cli._reading import (
    read_file,
    reading_options,
    table_options,
    weights_of_option,
)
from masrel.estimates import IntervalMethod
from masrel.ratings._findings import Reading

if TYPE_CHECKING:
    from masrel.analysis._file_questions import Question
    from masrel.ratings import RatingsFile

Option = Callable[..., Any]

_WIDTH, _WIDEST = 88, 100  # of notes where there is no terminal, and in one


def _list_register(
    context: click.Context, _: click.Parameter, value: list[str] | None
) -> list[str] | None:
    # "list" needs no file: it is seen before the file is missed
    if value != ["list"] or context.resilient_parsing:
        return value
    from masrel.agreement import COEFFICIENTS
    from masrel.tables._tables import aligned

    lines = [("name", "title", "raters", "weights", "also called")]
    for entry in COEFFICIENTS.values():
        fewest, most = entry.n_raters
        raters = str(fewest) if most == fewest else f"{fewest} or more"
        raters += ", each twice (--retest)" * (entry.shape == "pairs")
        more = ("any" if entry.weighted else "none", ", ".join(entry.aliases))
        lines.append((entry.name, entry.title, raters, *more))
    click.echo("\n".join(aligned(lines, ["left"] * 5, rule=True)))
    context.exit()


# How estimates are made, by names of options
_ESTIMATING = {
    "coefficients": click.option(
        "--coefficients",
        metavar="NAMES",
        show_default=",".join(USUAL),
        type=split_names,
        is_eager=True,
        callback=_list_register,
        help='Coefficients, separated by commas; "all" computes every one that '
        'fits, except lin_ccc, sem and mdc; "list" lists them.',
    ),
    "weights": click.option(
        "--weights",
        type=weights_of_option,
        default="identity",
        metavar="NAME|FILE",
        show_default=True,
        help="identity, linear, quadratic, ordinal, radical, ratio, circular or "
        "bipolar; or a file that holds a matrix, such as w.csv.",
    ),
    "metric": click.option(
        "--metric",
        type=click.Choice(
            ["nominal", "ordinal", "interval", "ratio", "jaccard", "masi"]
        ),
        help="Difference function of Krippendorff's alpha, used instead of weights; "
        "jaccard and masi are for grades with several labels: a;b, a|b or ['a', 'b'].",
    ),
    "target": click.option(
        "--target",
        type=click.Choice(["items", "raters", "both"]),
        help="Generalise to other items, raters, or both? Without it no interval is "
        "given.",
    ),
    "interval": click.option(
        "--interval",
        type=click.Choice(get_args(IntervalMethod)),
        default="auto",
        show_default=True,
        help="Method of the interval; auto chooses by the newest rule; analytic uses "
        "a formula, and the F distribution for an ICC.",
    ),
    "convention": click.option(
        "--convention",
        type=click.Choice(["irrcac", "spss", "over_n"]),
        help="Give the standard error and interval for other items that irrCAC, SPSS, "
        "or psych and vcd (over_n) print.",
    ),
    "level": level_option,
    "resamples": click.option(
        "--resamples",
        "n_resamples",
        default=10_000,
        show_default=True,
        help="Number of resamples of --interval bootstrap.",
    ),
    "seed": click.option(
        "--seed", default=0, show_default=True, help="Random seed for resampling."
    ),
    "words": click.option(
        "--words",
        type=click.Choice(["landis_koch", "altman", "fleiss", "cicchetti"]),
        help="Name the highest band that the true value reaches with 95 % probability.",
    ),
}

by_option = click.option(
    "--by", metavar="COL", help="Estimate separately for each group in this column."
)
_WORDING = (
    click.option(
        "--explain",
        is_flag=True,
        help="Also explain how the numbers were computed and what the intervals mean.",
    ),
    click.option(
        "--item-name",
        default="items",
        metavar="PLURAL",
        help="What to call the items in the text, such as patients.",
    ),
)
clusters_option = click.option(
    "--clusters",
    metavar="COL",
    help="Column of the clusters that items belong to, such as patients with several "
    "sites; a cluster is left out as a whole.",
)


def file_command(
    name: str,
    about: str,
    *reading: Option,
    estimating: Sequence[str],
    questions: Sequence[Option] = (),
    judging: Option | None = None,
    of_judges: "Sequence[Question]" = (),
    figure: str,
    sentence: str | None = None,
    **fixed: Any,
) -> click.Command:
    """Return a command that answers questions about a file of ratings."""
    # reading, questions: options of the command's own; estimating: names of those
    # that it shares with others; judging: those about judges, of whom counts say
    # nothing; of_judges: the functions that answer them; figure, sentence: helps of
    # these forms; fixed: questions that are no options
    shared = [_ESTIMATING[name] for name in estimating]
    of_counts = table_options if judging is None else []

    def command(
        file: Path,
        reading: Reading,
        questions: Questions,
        output: OutputOptions,
    ) -> None:
        questions = replace(questions, command=name, **fixed)
        _show_answers(file, reading, questions, output, *of_judges)

    # those of judges become a part of the questions, and so stand before them
    decorators: tuple[Option, ...] = (
        click.argument("file", type=InputFile(path_type=Path, allow_dash=True)),
        *([] if judging is None else [judging]),
        grouped("reading", Reading, *reading_options, *of_counts, *reading),
        grouped("questions", Questions, *shared, *questions),
        *_WORDING,
        output_options(
            json='Write JSON to this file; "-" writes it to standard output and '
            "prints nothing else.",
            figure=figure,
            html="Write a self-contained page with results, figures, and a methods "
            "text to paste.",
            csv="Print the table as CSV, with all digits.",
            latex="Print the table as LaTeX.",
            sentence=sentence,
        ),
    )
    for decorator in reversed(decorators):
        command = decorator(command)
    return click.command(name, help=about, cls=GroupedHelp)(command)


def _show_answers(
    file: Path,
    reading: Reading,
    questions: Questions,
    output: OutputOptions,
    *of_judges: "Question",
) -> None:
    """Read a file, and print or write what is asked of it."""
    questions = replace(
        questions.checked(reading.clusters), reference=reading.reference
    )
    with_pictures = ("diagnose", "judge", "limits")  # that need no target
    has_figure = questions.target or questions.command in with_pictures
    refuse(
        (
            output.figure is not None and not has_figure,
            "--figure: needs --target raters, items or both, because it shows "
            "intervals",
        ),
        (
            questions.truth and reading.repeated != "error",
            "--truth: uses every repeat, so it cannot be combined with --repeated "
            f"{reading.repeated}",
        ),
    )
    judging = questions.judging
    reading = replace(reading, repeated="each") if questions.truth else reading
    if judging is not None:  # of a stream nobody knows which item is which
        refuse(
            (
                judging.order is not None and reading.by is not None,
                "--order, --by: needed one of them, got both",
            )
        )
        reading = replace(reading, stream=False, by=judging.order or reading.by)
    known = () if judging is None else (*judging.judges, *(judging.humans or ()))
    ratings = read_file(file, replace(reading, known=known))
    questions = questions.on_scale(ratings)
    from masrel.analysis._file_questions import answers
    from masrel.pages._answer_page import answer_page
    from masrel.pages._pictures import main_picture
    from masrel.tables._answer_tables import agreement_sentences, answer_documents
    from masrel.tables._first_screen import (
        first_screen,
        judge_sentences,
        lacks_interval,
        left_out,
        reading_warnings,
    )
    from masrel.tables._tables import SIMULATED

    others, answered = answers(ratings, questions, *of_judges)
    is_agreement = answered[0].name == "agreement"
    is_sentence = output.sentence and (is_agreement or judging is not None)
    is_text = not (output.csv or output.latex or is_sentence)
    is_brief = is_text or (is_sentence and not is_agreement)
    table, *more = first_screen(
        *(others, questions, answered),
        detail="all" if output.explain else "brief" if is_brief else "usual",
        items=output.item_name,
        is_text=is_text,
        in_sentences=output.sentence,
    )
    notes = left_out(others, questions)
    warned = [f"warning: {text}" for text in reading_warnings(others, answered[0])]
    sentences: Callable[[], str] = partial(
        agreement_sentences,
        answered[0],
        bands=questions.words,
        data=table.data,
        items=output.item_name,
    )
    if not is_agreement and is_sentence:
        more = []  # a sentence says them all
        sentences = partial(judge_sentences, answered, output.item_name, table.data)
    write_output(
        output,
        document=lambda: _record(
            *(others, reading, questions),
            {of.name: answer_documents(of, questions.words) for of in answered},
            [*warned, *notes],
        ),
        text=sentences if is_sentence else lambda: table,
        figure=lambda: main_picture(answered, questions),
        html=lambda: answer_page(
            others, questions, answered, call=call_text(), items=output.item_name
        ),
        stamp=SIMULATED if others.simulated else "",
        notes=(*table.read, *notes),
        more=more,
        width=min(shutil.get_terminal_size((_WIDTH, 24)).columns, _WIDEST)
        if sys.stdout and sys.stdout.isatty()
        else _WIDTH,
    )
    if is_sentence:
        echo_notes((*table.read, *table.notes))
    echo_notes(warned)
    gates = [row for of in answered if of.name == "gates" for row in of.shown or ()]
    for row in gates:
        click.echo(row["result"], err=True)
    if not all(row["holds"] for row in gates):
        click.get_current_context().exit(1)
    # what came through a pipe is gone
    is_there = questions.target is None and Path(others.read["file"]).is_file()
    if is_there and answered[0].name == "agreement" and lacks_interval(answered[0]):
        _offer_interval(questions.command, output.item_name)


def _record(
    ratings: "RatingsFile",
    reading: Reading,
    questions: Questions,
    documents: dict[str, Any],
    notes: list[str],
) -> dict[str, object]:
    """Return everything for JSON."""
    from masrel import __version__

    read, scale = dict(ratings.read), ratings.scale
    return {
        "masrel": __version__,
        "file": read.pop("file"),
        "sha256": ratings.sha256(),
        "options": {**questions.record(), "by": read["by"]},
        "scale": {
            "name": scale.name,
            "grades": list(scale.grades),
            "values": list(scale.values),
        },
        "read": {**read, "options": reading.record()},
        "notes": notes,
        "estimates": documents.pop("agreement", []),
        **documents,
    }


def _offer_interval(command: str, items: str) -> None:
    """Print the command that gives an interval."""
    more, arguments = ["--target", "items"], sys.argv[2:]  # as they were typed
    # what follows a -- is no option
    parts = [*more, *arguments] if "--" in arguments else [*arguments, *more]
    call = shlex.join(["masrel", command, *parts])
    click.echo(
        f"No interval was asked for. To generalise to other {items}, add --target "
        f"items: {call}",
        err=True,
    )
