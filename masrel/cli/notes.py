"""Warnings of masrel as one-line notes on stderr."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import click

from masrel.errors import MasrelWarning

__all__ = ["notes"]


@contextmanager
def notes() -> Iterator[None]:
    """Show warnings of masrel as notes, each once; leave all others as they are."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            yield
        finally:
            said = {str(w.message): None for w in caught if _is_ours(w)}
            for message in said:
                click.echo(f"note: {message}", err=True)
    for foreign in caught:
        if not _is_ours(foreign):
            warnings.warn_explicit(
                foreign.message, foreign.category, foreign.filename, foreign.lineno
            )


def _is_ours(warning: warnings.WarningMessage) -> bool:
    return issubclass(warning.category, MasrelWarning)
