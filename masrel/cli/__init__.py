"""The command line: one verb a file, loaded only when it is called.

Exit codes: 0 fine; 1 the run failed; 2 the input or the call is wrong. Errors
go to stderr as sentences; a traceback is a bug.
"""

import atexit
import codecs
import gc
import importlib
import io
import sys
import unicodedata
import warnings
from typing import Any, NoReturn

import click

import masrel
from masrel.errors import (
    ConvergenceError,
    DeviceError,
    MasrelError,
    ParameterError,
    SessionStoppedError,
)

__all__ = ["main"]

GROUPS = {
    "Ratings you have": {
        "agree": "Agreement of the raters in any file, no study needed.",
        "compare": "Whether groups of ratings differ in agreement.",
        "diagnose": "Which rater, which pair and which category disagree.",
        "limits": "Limits of agreement of two raters who measured.",
        "latent": "Biases and noises of the raters in any file, items on one scale.",
        "plan": "How many items and raters a study needs, and what it can show.",
        "audit": "Whether any table gives the agreement that a paper prints.",
    },
    "A study": {
        "init": "Make a new study from a template.",
        "check": "Validate a study and say every error.",
        "schedule": "Draw the schedules of a study, once.",
        "between": "Models between models: dummies that hide a study's standards.",
        "demo": "The whole flow on the simulated device.",
    },
    "Its conduct": {
        "train": "Teach a rater on models of known grade, until a test is passed.",
        "run": "Present a schedule's models and record every grade.",
        "serve": "Pages for the rater's tablet and the coordinator's screen.",
        "sheet": "Sheets to print for raters who grade on paper.",
        "enter": "Bring in a sheet that was filled in on paper.",
        "status": "How far a study is, and what to do next.",
        "note": "Record a note, a deviation or an adverse event.",
        "rater": "What is known of raters, and who is left out of the analysis.",
        "merge": "Put the sites of one study together in one folder.",
        "ratings": "Turn session logs into the table of ratings.",
        "analyze": "Compute the agreement tables a study asks for.",
        "grading": "Regress grades on the models' parameters and the speed.",
        "report": "Write the report of a study.",
        "export": "Write a study as BIDS or as an RO-Crate.",
        "checklist": "Fill a reporting guideline, GRRAS or COSMIN, from the record.",
        "verify": "Hold every file of a study against the one before it.",
        "withdraw": "Record that a rater has left; the grades are kept.",
        "unblind": "Say which model a code stands for, and record who asked.",
    },
    "The joint and the device": {
        "trace": "Torque trace of one stretch of one model.",
        "fit": "Identify a joint, or a device's friction, from recordings.",
        "device": "Bring a Puck up on its CAN bus: probe, check, zero, friction.",
    },
}
"""Verbs with their summaries, as --help shows them."""

VERBS = {verb: text for verbs in GROUPS.values() for verb, text in verbs.items()}
"""Verb to summary. The verb ``x`` is the command ``x`` of the module ``x``."""

# verbs that need no study; the modules of the others are in the laboratory
_STATISTICS = tuple(GROUPS["Ratings you have"])

# parameters whose options are called otherwise
_CALLED = {
    "coefficient": "coefficients",
    "high": "interval",
    "low": "interval",
    "method": "interval",
    "rng": "seed",
}


class _Verbs(click.Group):
    """A group that imports a verb only when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in VERBS:
            if ctx.resilient_parsing:  # as it is where a shell completes names
                return None
            from difflib import get_close_matches  # loaded only for an error

            near = get_close_matches(cmd_name, VERBS, n=1)
            hint = f" Did you mean '{near[0]}'?" if near else ""
            ctx.fail(f"No such command '{cmd_name}'.{hint}")
        package = "masrel.cli" if cmd_name in _STATISTICS else "masrel.lab.cli"
        command: click.Command = getattr(
            importlib.import_module(f"{package}.{cmd_name}"), cmd_name
        )
        return command

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except ParameterError as error:
            command = self.get_command(ctx, str(ctx.invoked_subcommand))
            params = [] if command is None else command.params
            options = {param.name: max(param.opts, key=len) for param in params}
            for name, other in _CALLED.items():
                if other in options:
                    options.setdefault(name, options[other])
            # the places that a refusal begins with are parameters: here they are
            # options
            *places, rest = str(error).split(": ")
            for at, place in enumerate(places):
                names = place.split(", ")
                if options.keys() >= set(names):
                    places[at] = ", ".join(options[name] for name in names)
            raise ParameterError(": ".join([*places, rest])) from error

    def format_commands(
        self,
        ctx: click.Context,  # noqa: ARG002 - click's signature
        formatter: click.HelpFormatter,
    ) -> None:
        # Summaries are listed here so that --help imports no verb.
        for title, verbs in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl(list(verbs.items()))


cli = click.version_option(masrel.__version__, prog_name="masrel")(
    _Verbs(
        context_settings={"help_option_names": ["-h", "--help"]},
        help="Agreement of any file of ratings, and studies on a simulator of "
        "spasticity.\n\n"
        "To begin, with a file of ratings: masrel agree FILE --target items",
    )
)


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
        sys.exit(cli.main(standalone_mode=False) or 0)
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
        _fail(f"needs more memory than there is. {error}".rstrip(". "), 1)
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
    letters = error.object[error.start : error.end]
    return "".join(map(_spelled, letters)), error.end


def _spelled(letter: str) -> str:
    # A name of somebody stays what it is, in escapes.
    if letter in _SIGNS:
        return _SIGNS[letter]
    words = unicodedata.name(letter, "").split()
    if words[:1] == ["GREEK"] and words[2:3] == ["LETTER"] and len(words) == 4:
        return words[3].lower() if words[1] == "SMALL" else words[3].capitalize()
    return letter.encode("ascii", "backslashreplace").decode("ascii")


codecs.register_error("masrel", _in_other_letters)
