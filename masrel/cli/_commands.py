"""Groups of commands: imported when they are called, refused by their new names."""

import importlib
from collections.abc import Callable
from typing import Any

import click

from masrel.errors import ParameterError

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

MODES = ("plan --judge",)
"""Options that make another command of one, with options of its own."""

STUDY = "STUDY"
"""Name of the command of a group that does what the group is named after."""

# parameters whose options are called otherwise
_CALLED = {
    "coefficient": "coefficients",
    "high": "interval",
    "human_accuracy": "accuracy",
    "judge_accuracy": "accuracy",
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
            if (old := f"{' '.join(path.split()[1:2])} {error.option_name}") in RENAMED:
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
                if options.keys() >= set(names := place.split(", ")):
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
        for mode in MODES:
            command, option = mode.split()
            if args[0] == command and option in args:
                rest = [arg for arg in args[1:] if arg != option]
                return mode, self.get_command(ctx, mode), rest
        return super().resolve_command(ctx, args)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command."""
        known = self.list_commands(ctx)
        if cmd_name not in (*known, *MODES):
            if ctx.resilient_parsing:  # as it is where a shell completes names
                return None
            from difflib import get_close_matches  # loaded only for an error

            near = get_close_matches(cmd_name, known, n=1)
            hint = f" Did you mean '{near[0]}'?" if near else ""
            ctx.fail(f"No such command '{cmd_name}'.{hint}")
        name = cmd_name.replace(" --", "_")
        module = importlib.import_module(self.place(name))
        command: click.Command = getattr(module, name)
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
