"""Options that several commands share, and what commands print."""

import json
import re
import shlex
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from masrel._files import write_file
from masrel._input import refuse
from masrel.cli._paths import FileInFolder, OutputFile

if TYPE_CHECKING:
    from masrel.plots._drawn_values import Drawn, Form
    from masrel.tables._tables import Table

Command = Callable[..., None]
Decorator = Callable[[Command], Command]

STDOUT = Path("-")
"""What a file is called that is printed."""

_FORMS: dict[str, "Form"] = {".png": "png", ".svg": "svg", ".pdf": "pdf"}


# Groups of options by the name of their argument, as --help heads them
_HEADINGS = {
    "reading": "Reading FILE",
    "judging": "Judges",
    "questions": "Estimating",
    "joints": "Joints",
    "stretch": "Motion",
    "quantities": "Quantities",
    "recordings": "Reading RECORDINGS",
    "gating": "Gates",
    "comparing": "Comparison",
    "output": "Output",
}


class GroupedHelp(click.Command):
    """A command whose help shows options under the headings of their groups."""

    def format_options(
        self, ctx: click.Context, formatter: click.HelpFormatter
    ) -> None:
        """Write what belongs to no group first, and --help with it."""
        parts: dict[str, list[tuple[str, str]]] = {"Options": []}
        for param in self.get_params(ctx):
            if (shown := param.get_help_record(ctx)) is not None:
                heading = vars(param).get("heading", "Options")
                parts.setdefault(heading, []).append(shown)
        for heading, records in parts.items():
            with formatter.section(heading):
                formatter.write_dl(records)


def grouped(name: str, group: type, *options: Callable[..., Any]) -> Decorator:
    """Return a decorator that gives a command several options as one argument."""
    # the command may have some of the group's options, in any place among its others
    keys = [field.name for field in fields(group)]

    def decorate(command: Command) -> Command:
        @wraps(command)
        def with_group(*study: object, **args: object) -> None:
            values = {key: args.pop(key) for key in keys if key in args}
            command(*study, **args, **{name: group(**values)})

        for option in reversed(options):
            option(with_group)
        for param in vars(with_group)["__click_params__"][-len(options) :]:
            vars(param)["heading"] = _HEADINGS[name]
        return with_group

    return decorate


level_option = click.option(
    "--level", default=0.95, show_default=True, help="Level of the intervals."
)


def split_commas(text: str) -> list[str]:
    """Return the parts of an option's value between its commas."""
    return [part.strip() for part in text.split(",")]


def floats(text: str, number: type = float) -> list[Any]:
    """Return numbers separated by commas, or first:last:step."""
    try:
        numbers = [number(part) for part in re.split("[,:]", text)]
        if ":" in text:
            first, last, step = numbers
            n_steps = int((last - first) / step + 1e-9)
            numbers = [number(round(first + k * step, 12)) for k in range(n_steps + 1)]
    except (ValueError, ZeroDivisionError):
        numbers = []
    if not numbers:
        raise click.BadParameter(f"needs numbers as 10,20 or 10:50:10, got {text!r}")
    return numbers


def whole_numbers(text: str) -> list[int]:
    """Return the same, if they are whole."""
    return floats(text, int)


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputOptions:
    """What is written and printed; a verb offers some of these options."""

    json_file: Path | None = None  # where JSON goes; "-" is the screen
    figure: Path | None = None  # where a figure goes
    html: Path | None = None  # where a page goes
    # csv, latex: in which form the table is printed; as text when neither
    csv: bool | None = None  # None where a command has no such table
    raw_csv: bool = False  # whether cells of CSV are as they are
    latex: bool = False
    sentence: bool = False  # whether sentences are printed instead of a table
    quiet: bool = False  # without progress: to tqdm `or None`, terminals alone
    explain: bool = False  # whether notes say all
    item_name: str = "items"  # what they are called, in the plural

    def __post_init__(self) -> None:
        forms = {
            "--json -": self.json_file == STDOUT,
            "--csv": self.csv,
            "--latex": self.latex,
            "--sentence": self.sentence,
        }
        printed = [option for option, is_printed in forms.items() if is_printed]
        suffix = ".svg" if self.figure is None else self.figure.suffix.lower()
        refuse(
            (
                suffix not in _FORMS,
                f"--figure: needs a name that ends in .png, .svg or .pdf, got "
                f"{self.figure}",
            ),
            (
                self.html is not None and self.html.suffix.lower() != ".html",
                f"--html: needs a name that ends in .html, got {self.html}",
            ),
            (
                self.raw_csv and self.csv is False,
                "--raw-csv: needs --csv",
            ),
            (
                len(printed) > 1,
                f"{' and '.join(printed)} both write to standard output: choose one",
            ),
        )


JSON_NAME = "masrel.json_name"  # where a call has the function to it from a command
_FORMAT = 1  # of what verbs write as JSON
_RAW = (
    "With --csv: do not put an apostrophe before cells that a spreadsheet would run "
    "as formulas."
)


def output_options(
    *,
    json: str | None = None,
    figure: str | None = None,
    html: str | None = None,
    csv: str | None = None,
    raw_csv: str | None = None,
    latex: str | None = None,
    sentence: str | None = None,
    quiet: str | None = None,
    makes_folder: bool = False,
) -> Decorator:
    """Return the options with these helps, as one argument `output` of a command."""
    # makes_folder: whether the command makes a folder that JSON may go to
    json_kind = OutputFile if makes_folder else FileInFolder
    json_path = json_kind(path_type=Path, allow_dash=True)
    raw_csv = raw_csv or (_RAW if csv is not None else None)
    figures = FileInFolder(path_type=Path, dir_okay=False)
    options = [
        (json, click.option("--json", "json_file", type=json_path, help=json)),
        (figure, click.option("--figure", type=figures, help=figure)),
        (html, click.option("--html", type=figures, help=html)),
        (csv, click.option("--csv", is_flag=True, help=csv)),
        (raw_csv, click.option("--raw-csv", is_flag=True, help=raw_csv)),
        (latex, click.option("--latex", is_flag=True, help=latex)),
        (sentence, click.option("--sentence", is_flag=True, help=sentence)),
        (quiet, click.option("--quiet", is_flag=True, help=quiet)),
    ]
    offered = [option for text, option in options if text is not None]
    return grouped("output", OutputOptions, *offered)


def write_output(
    output: OutputOptions,
    *,
    document: Callable[[], dict[str, object]],
    text: "Callable[[], Table | str]",
    figure: "Callable[[], Drawn] | None" = None,
    html: Callable[[], str] | None = None,
    stamp: str = "",
    notes: tuple[str, ...] = (),
    more: "Sequence[Table]" = (),
    width: int | None = None,
    mode: int | None = None,
) -> None:
    """Write and print a result in the forms that were chosen, and make no other."""
    # stamp: what the figure says of its data; notes: those of a table, which are on
    # stderr where JSON is printed; more: tables below the first; width: to which notes
    # of a text are wrapped; mode: permissions of what is written
    if output.json_file == STDOUT:
        echo_notes(notes)
    else:  # first: a disk that is full then loses no result
        parts = (text(), *more)
        click.echo("\n\n".join(_shown(part, output, width) for part in parts))
        for table in parts:
            if output.csv and not isinstance(table, str):
                echo_notes((*table.read, *table.notes))
    if output.json_file is not None:
        write_json(document(), output.json_file, mode=mode)
    if figure is not None and output.figure is not None:
        # Imported here: a table loads nothing that draws.
        from masrel.plots import draw

        form = _FORMS[output.figure.suffix.lower()]
        picture = draw(figure(), stamp=stamp, forms=(form,))[form]
        write_file(output.figure, picture, mode=mode)
        click.echo(f"figure: {output.figure}", err=True)
    if html is not None and output.html is not None:
        write_file(output.html, html())
        click.echo(f"page: {output.html}", err=True)


def _shown(part: "Table | str", output: OutputOptions, width: int | None) -> str:
    from masrel.tables._latex import as_latex
    from masrel.tables._tables import as_csv, as_text

    if isinstance(part, str):
        return part
    if output.csv:
        return as_csv(part, raw=output.raw_csv).rstrip("\n")
    return as_latex(part).rstrip("\n") if output.latex else as_text(part, width=width)


def write_json(
    document: dict[str, object], file: Path, *, mode: int | None = None
) -> None:
    """Write a document, or print it where the file is "-"; it names its format."""
    if "format" not in document:
        context = click.get_current_context()
        # the first word is as the user called it
        words = context.command_path.removeprefix(context.find_root().command_path)
        named = context.meta.get(JSON_NAME, str)(words.strip())
        document = {"format": f"masrel {named} {_FORMAT}", **document}
    text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    if file != STDOUT:
        write_file(file, text + "\n", mode=mode)
        return
    try:
        text.encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:  # escapes of JSON for letters that it cannot show
        text = json.dumps(document, indent=1)
    click.echo(text)


def call_text() -> str:
    """Return this call as it is typed in a shell."""
    return shlex.join(["masrel", *sys.argv[1:]])


_NOTES = "masrel.notes"


def notes_of_call() -> list[str]:
    """Return the notes that this call has printed."""
    ctx = click.get_current_context(silent=True)
    notes: list[str] = [] if ctx is None else ctx.meta.setdefault(_NOTES, [])
    return notes


def echo_notes(notes: Sequence[str]) -> None:
    """Print notes on stderr, one a line."""
    notes_of_call().extend(notes)
    click.echo("".join(f"{note}\n" for note in notes), err=True, nl=False)


_PERIOD_S = 10.0  # between lines that say how far a command has come

Report = Callable[[int, int], None]
"""Is told how many steps are made, and how many there will be."""


@contextmanager
def progress(description: str, unit: str, *, is_quiet: bool) -> Iterator[Report]:
    """Show a bar on stderr, or a line every ten seconds if that is not a terminal."""
    start = last = time.monotonic()

    def line(n_made: int, n_expected: int) -> None:
        nonlocal last
        now = time.monotonic()
        if is_quiet or n_made == 0 or now - last < _PERIOD_S:
            return
        last = now
        share = n_made / max(n_expected, n_made)
        left = _duration((now - start) * (1.0 / share - 1.0))
        click.echo(f"{description}: {100.0 * share:.0f} %, {left} left", err=True)

    if is_quiet or not (sys.stderr and sys.stderr.isatty()):
        yield line
        return
    from tqdm import tqdm

    # nothing is shown of a call that is refused at once
    with tqdm(desc=description, unit=unit, delay=0.01) as bar:

        def move(n_made: int, n_expected: int) -> None:
            bar.total = n_expected
            bar.update(n_made - bar.n)

        yield move


def _duration(seconds: float) -> str:
    # no more exact than an estimate is
    if seconds >= 90.0:
        return f"about {seconds / 60.0:.0f} min"
    shown = round(seconds, -1) if seconds >= 10.0 else max(seconds, 1.0)
    return f"about {shown:.0f} s"
