"""The interpreter: which modules load late, and when garbage is collected."""

import gc
import importlib
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager


def loaded_from(
    package: str, homes: Mapping[str, str], *, packages: Collection[str] = ()
) -> Callable[[str], object]:
    """Return the ``__getattr__`` of a package: names by module, and its packages."""

    # They are loaded where they are first used (PEP 562).
    def load(name: str) -> object:
        if name in homes:
            return getattr(importlib.import_module(f"{package}.{homes[name]}"), name)
        if name in packages:
            return importlib.import_module(f"{package}.{name}")
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return load


@contextmanager
def collector_off() -> Iterator[None]:
    """Keep the garbage collector off until the block ends."""
    # It costs time, and there is nothing that it could take away.
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
