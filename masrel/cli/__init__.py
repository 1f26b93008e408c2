"""The command line: one command a file, loaded only when it is called.

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
from collections.abc import Callable
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
        "demo": "The whole flow on the simulated device.",
        "init": "Make a new study from a template.",
        "check": "Validate a study and say every error.",
        "schedule": "Draw the schedules of a study, once; show; copy for a site.",
        "run": "Present a schedule's models and record every grade.",
        "serve": "Pages for the rater's tablet and the coordinator's screen.",
        "train": "Teach a rater on models of known grade, until a test is passed.",
        "paper": "Sheets to print, and to enter once they are filled in.",
        "record": "Notes, events, corrections, and what becomes of raters.",
        "status": "How far a study and its raters are, and what to do next.",
        "merge": "Put the sites of one study together in one folder.",
        "ratings": "Turn session logs into the table of ratings.",
        "analyze": "Compute the agreement tables a study asks for.",
        "report": "Write the report of a study.",
        "verify": "Hold every file of a study against the one before it.",
        "export": "Write a study as BIDS or as an RO-Crate.",
        "checklist": "Fill a reporting guideline, GRRAS or COSMIN, from the record.",
        "grading": "Regress grades on the models' parameters and the speed.",
    },
    "Joint and device": {
        "joint": "Traces of joints, joints of recordings, and models between.",
        "device": "Bring a Puck up on its CAN bus: probe, check, zero, friction.",
    },
}
"""Commands with their summaries, as --help shows them."""

RENAMED = {
    "trace": "joint trace",
    "trace --tardieu": "joint tardieu",
    "fit": "joint fit",
    "fit --friction": "joint friction",
    "between": "joint between",
    "sheet": "paper print",
    "enter": "paper enter",
    "enter --second": "paper again",
    "note": "record note",
    "note --kind": "record deviation, or record adverse-event",
    "withdraw": "record withdraw",
    "unblind": "record unblind",
    "rater": "record rater",
    "rater set": "record rater",
    "rater exclude": "record exclude",
    "rater include": "record include",
    "rater list": "status raters",
    "run --correct": "record correct",
    "run --skip": "record skip",
    "run --question": "record answer",
    "schedule --show": "schedule show",
    "schedule --copy-to": "schedule copy",
    "train --report": "train show",
}
"""Commands of 0.1, and options that were modes, with what they are called now."""

STUDY = "STUDY"
"""Name of the command of a group that does what the group is named after."""

# whose command needs no study; the modules of the others are in the laboratory
_STATISTICS = tuple(GROUPS["Ratings you have"])

# parameters whose options are called otherwise
_CALLED = {
    "coefficient": "coefficients",
    "high": "interval",
    "low": "interval",
    "method": "interval",
    "rng": "seed",
}


def json_name(command: str) -> str:
    """Return what the JSON of a command says it is of: the name it had first."""
    for old, new in RENAMED.items():
        if new == command:
            return old.partition(" --")[0]
    return command.removesuffix(f" {STUDY}")


class Commands(click.Group):
    """A group whose refusals name options; its command STUDY need not be named."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put STUDY before the arguments where no command is named."""
        known = (*self.list_commands(ctx), *ctx.help_option_names)
        if STUDY in self.commands and args and args[0] not in known:
            args = [STUDY, *args]
        return super().parse_args(ctx, args)

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return every name, in the order in which commands are used."""
        return list(self.commands)

    def format_commands(
        self,
        ctx: click.Context,  # noqa: ARG002 - click's signature
        formatter: click.HelpFormatter,
    ) -> None:
        """List the commands with their first sentences."""
        with formatter.section("Commands"):
            formatter.write_dl(
                [
                    (name, command.get_short_help_str(limit=200))
                    for name, command in self.commands.items()
                ]
            )

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; name the options that a refusal of parameters is about."""
        ctx.meta["masrel.json_name"] = json_name
        try:
            return super().invoke(ctx)
        except click.NoSuchOption as error:
            path = "" if error.ctx is None else error.ctx.command_path
            old = f"{' '.join(path.split()[1:2])} {error.option_name}"
            if old in RENAMED:
                raise _renamed(old, ctx) from error
            raise
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


def _renamed(old: str, ctx: click.Context) -> click.UsageError:
    return click.UsageError(f"masrel {old} is now masrel {RENAMED[old]}", ctx)


class ListedCommands(Commands):
    """A group with a list of its commands: one is imported only when it is called."""

    def __init__(
        self,
        *args: Any,
        parts: dict[str, dict[str, str]],
        place: Callable[[str], str],
        **attrs: Any,
    ) -> None:
        # parts: titles, names and summaries, as --help shows them; place: the module
        # of a command
        super().__init__(*args, **attrs)
        self.parts, self.place = parts, place

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return every name."""
        return [name for part in self.parts.values() for name in part]

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return a command and what is left to it; say what an old one is called."""
        for old in (" ".join(args[:2]), args[0]):
            if old in RENAMED and args[0] not in self.list_commands(ctx):
                raise _renamed(old, ctx)
        return super().resolve_command(ctx, args)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command."""
        known = self.list_commands(ctx)
        if cmd_name not in known:
            if ctx.resilient_parsing:  # as it is where a shell completes names
                return None
            from difflib import get_close_matches  # loaded only for an error

            near = get_close_matches(cmd_name, known, n=1)
            hint = f" Did you mean '{near[0]}'?" if near else ""
            ctx.fail(f"No such command '{cmd_name}'.{hint}")
        module = importlib.import_module(self.place(cmd_name))
        command: click.Command = getattr(module, cmd_name)
        return command

    def format_commands(
        self,
        ctx: click.Context,  # noqa: ARG002 - click's signature
        formatter: click.HelpFormatter,
    ) -> None:
        """List the summaries, so that --help imports no command."""
        for title, commands in self.parts.items():
            with formatter.section(title):
                formatter.write_dl(list(commands.items()))


def _module_of(command: str) -> str:
    place = "masrel.cli" if command in _STATISTICS else "masrel.lab.cli"
    return f"{place}.{command}"


cli = ListedCommands(
    parts=GROUPS,
    place=_module_of,
    context_settings={"help_option_names": ["-h", "--help"]},
    add_help_option=False,
    help="\b\nAgreement of any file of ratings, and studies on a simulator of "
    "spasticity.\nTo begin, with a file of ratings: masrel agree FILE --target items",
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
