"""Options of a verb that belong together, as one argument."""

from collections.abc import Callable
from dataclasses import fields
from functools import wraps
from typing import Any

__all__ = ["grouped"]

Command = Callable[..., None]
Decorator = Callable[[Command], Command]


def grouped(name: str, group: type, *options: Callable[..., Any]) -> Decorator:
    """Give a command several options as one argument."""
    names = [field.name for field in fields(group)]

    def decorate(command: Command) -> Command:
        @wraps(command)
        def taken(**given: object) -> None:
            own = {key: given.pop(key) for key in names}
            command(**given, **{name: group(**own)})

        made: Command = taken
        for option in reversed(options):
            made = option(made)
        return made

    return decorate
