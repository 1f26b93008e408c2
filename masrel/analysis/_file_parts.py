"""Parts of a file of ratings: what they are called, and who rated what."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from masrel.agreement import CodedRatings, code_ratings
from masrel.errors import ParameterError, RatingsError
from masrel.ratings import RatingsFile, RatingsPart
from masrel.ratings._doubts import doubt_of_name

_SHOWN = 6  # names that a note lists


def part_names(file: RatingsFile, part: RatingsPart) -> dict[str, str]:
    """Return what tells a part from the others: names of columns, and what they say."""
    names = {}
    if part.group is not None:
        names[str(file.read["by"])] = part.group
    if part.session is not None and len({other.session for other in file.parts}) > 1:
        names[str(file.read["session"])] = part.session
    return names


def label(names: Iterable[str]) -> str:
    """Return what something is called, from the group down."""
    return ": ".join(names)


def named(names: Sequence[str]) -> str:
    """Return names as a note lists them."""
    listed = ", ".join(names[:_SHOWN])
    more = len(names) - _SHOWN
    return f"{listed} and {more} more" if more > 0 else listed


def coded_part(part: RatingsPart, option: str) -> CodedRatings:
    """Return the ratings of a part, of which it must be known who rated what."""
    try:
        return code_ratings(part.ratings)
    except RatingsError as error:
        raise RatingsError(f"{option}: {error}") from error


def without_reference(file: RatingsFile, reference: str) -> RatingsFile:
    """Return the ratings of all but the rater whom the others are held against."""
    doubt = doubt_of_name(reference)
    return replace(
        file,
        parts=tuple(_without(part, reference) for part in file.parts),
        warnings=tuple(text for text in file.warnings if not text.startswith(doubt)),
    )


def _without(part: RatingsPart, reference: str) -> RatingsPart:
    coded = coded_part(part, "--diagnose")
    if reference not in part.raters:
        raise ParameterError(
            f"--reference: needs one of {', '.join(part.raters)}, got {reference!r}"
        )
    others = [place for place, name in enumerate(part.raters) if name != reference]
    return replace(
        part,
        raters=tuple(part.raters[place] for place in others),
        ratings=replace(coded, codes=coded.codes[:, others]),
    )


def two_raters(file: RatingsFile, part: RatingsPart, option: str) -> CodedRatings:
    """Return the ratings of a part, of which there must be two raters."""
    coded = coded_part(part, option)
    if coded.codes.shape[1] != 2:
        of_part = "".join(f"{name}: " for name in part_names(file, part).values())
        raise RatingsError(
            f"{option}: {of_part}needs two raters, got {coded.codes.shape[1]} "
            f"({named(part.raters)}); --raters chooses two"
        )
    return coded
