"""What the keys of every table of a protocol file are made of."""

from typing import Annotated

import msgspec
from msgspec import Meta

_Identifier = Annotated[str, Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,31}\Z")]
_Text = Annotated[str, Meta(min_length=1)]


class _Table(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table of the protocol file; unknown keys are errors."""
