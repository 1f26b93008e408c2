"""The presentations for practice: the same for every rater, with codes of their own."""

from itertools import count

from masrel.lab.protocol import Protocol
from masrel.lab.schedule import Presentation


def practice_presentations(protocol: Protocol) -> tuple[Presentation, ...]:
    """Return what comes before the first presentation of a schedule."""
    # A schedule's codes begin with digits; a code that is a model's id would name it.
    ids = {model.id.upper() for model in protocol.models}
    codes = (code for n in count(1) if (code := f"P{n}") not in ids)
    return tuple(
        Presentation(position=place, code=code, model=model, repeat=0)
        for place, (model, code) in enumerate(
            zip(protocol.occasions.practice, codes, strict=False), start=1
        )
    )
