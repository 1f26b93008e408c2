"""The command line: one command a file, loaded only when it is called.

Exit codes: 0 fine; 1 the run failed; 2 the input or the call is wrong. Errors
go to stderr as sentences; a traceback is a bug.
"""

import atexit
import codecs
import gc
import io
import sys
import unicodedata
import warnings
from typing import NoReturn

import click

import masrel
from masrel.cli._commands import ListedCommands
from masrel.errors import (
    ConvergenceError,
    DeviceError,
    MasrelError,
    SessionStoppedError,
)

__all__ = ["main"]

GROUPS = {
    "Ratings you have": {
        "agree": "Estimate how well the raters in a file agree.",
        "compare": "Compare the agreement of groups.",
        "diagnose": "Find the raters, pairs and categories that disagree.",
        "limits": "Compute limits of agreement, also for repeated measurements.",
        "gstudy": "Estimate how reliable means over raters and occasions are.",
        "spans": "Measure agreement on marked parts of texts or recordings.",
        "judge": "Test whether a judge, such as a model, can replace a human.",
        "latent": "Estimate each rater's bias and noise, and each item's severity.",
        "plan": "Find how many items and raters a study needs.",
        "audit": "Check whether any table gives the agreement that a paper reports.",
    },
    "A study": {
        "demo": "Run a complete simulated study.",
        "init": "Make a new study from a template.",
        "check": "Check a study and list every problem.",
        "schedule": "Draw schedules, show their balance, or copy a study for a site.",
        "run": "Present a schedule's models and record every grade.",
        "serve": "Show pages for the rater's tablet and the coordinator's screen.",
        "train": "Train a rater on models of known grade until a test is passed.",
        "paper": "Print sheets for grading on paper, and enter completed ones.",
        "record": "Record notes, events, corrections and changes of raters.",
        "status": "Show the progress of a study, and the next step.",
        "merge": "Combine the sites of one study in one folder.",
        "ratings": "Make the table of ratings from the session logs.",
        "analyze": "Compute the analysis that a study's plan asks for.",
        "report": "Write the report of a study.",
        "verify": "Check every file of a study against the file it was made from.",
        "export": "Write a study as BIDS or RO-Crate.",
        "checklist": "Fill in a reporting guideline, GRRAS or COSMIN, from the record.",
        "grading": "Regress grades on the models' parameters and the speed.",
    },
    "Joint and device": {
        "joint": "Trace or fit joints, and create models between two others.",
        "device": "Bring up a motor on its CAN bus: probe, check, zero, friction.",
    },
}
"""Commands with their summaries, as --help shows them."""

# whose command needs no study; the modules of the others are in the laboratory
_STATISTICS = tuple(GROUPS["Ratings you have"])


cli = ListedCommands(
    parts=GROUPS,
    place=lambda name: (
        f"masrel{'' if name.partition('_')[0] in _STATISTICS else '.lab'}.cli.{name}"
    ),
    context_settings={"help_option_names": ["-h", "--help"]},
    add_help_option=False,
    help="\b\nAgreement statistics for ratings, and studies on a simulator of "
    "spasticity.\nTo start with a file of ratings: masrel agree FILE --target items",
)
cli = click.version_option(masrel.__version__, prog_name="masrel")(cli)
cli = click.help_option("-h", "--help", hidden=True)(cli)  # whoever reads it knows


def main() -> None:
    """Run the command line and exit with its code."""
    atexit.register(_leave)
    # a sentence, without a line of our code
    warnings.formatwarning = lambda message, *_, **__: f"warning: {message}\n"
    for stream in (sys.stdout, sys.stderr):
        # One that somebody has told what to do with letters it lacks goes on doing it
        if isinstance(stream, io.TextIOWrapper) and stream.errors in _USUAL_ERRORS:
            stream.reconfigure(errors="masrel")
    try:
        sys.exit(cli.main(prog_name="masrel", standalone_mode=False) or 0)
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except click.Abort:
        _fail("stopped by Ctrl-C", 1)
    except (DeviceError, ConvergenceError, SessionStoppedError) as error:
        _fail(error, 1)
    except MasrelError as error:
        _fail(error, 2)
    except MemoryError as error:
        _fail(f"there is not enough memory. {error}".rstrip(". "), 1)
    except OSError as error:
        where = "" if error.filename is None else f"{error.filename}: "
        _fail(f"{where}{error.strerror or error}", 2)


def _leave() -> None:
    # What is left at the end goes with the process: no collector need look through it;
    # but what DuckDB finds uncollected it reports on stderr.
    if "duckdb" not in sys.modules:
        gc.freeze()


def _fail(error: object, code: int) -> NoReturn:
    click.echo(f"masrel: {error}", err=True)
    sys.exit(code)


_USUAL_ERRORS = ("strict", "surrogateescape", "backslashreplace")

_SIGNS = {
    "−": "-",
    "–": "-",
    "—": "-",
    "·": ".",
    "×": "x",
    "±": "+-",
    "²": "^2",
    "³": "^3",
    "°": "deg",
    "∞": "inf",
    "≤": "<=",
    "≥": ">=",
    "√": "sqrt",
    "…": "...",
    "‘": "'",
    "’": "'",
    "“": '"',
    "”": '"',
}


def _in_other_letters(error: UnicodeError) -> tuple[str, int]:
    # what stdout and stderr cannot encode, on Windows' cp1252 say, they write in others
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(_spelled, error.object[error.start : error.end])), error.end


def _spelled(letter: str) -> str:
    # A name of somebody stays what it is, in escapes.
    if letter in _SIGNS:
        return _SIGNS[letter]
    words = unicodedata.name(letter, "").split()
    if words[:1] == ["GREEK"] and words[2:3] == ["LETTER"] and len(words) == 4:
        return words[3].lower() if words[1] == "SMALL" else words[3].capitalize()
    return letter.encode("ascii", "backslashreplace").decode("ascii")


codecs.register_error("masrel", _in_other_letters)
