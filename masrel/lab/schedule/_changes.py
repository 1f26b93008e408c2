"""What of a protocol has changed since schedules were drawn, key by key."""

import hashlib
import json
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from masrel.lab.protocol import Protocol, StudyPaths, presented_content

_SHOWN = 4  # keys that are named

_NOT_SET = object()


def content_file(study: StudyPaths, sha256: str) -> Path:
    """Return the file that keeps what schedules with this hash were drawn from."""
    return study.schedules / f"presented_{sha256[:12]}.json"


def stale_sentences(
    protocol: Protocol, study: StudyPaths, drawn_from: Iterable[str], n_schedules: int
) -> Iterator[str]:
    """Yield a sentence for all schedules that were drawn from the same protocol."""
    # drawn_from: hash of what was presented at the draw, of each stale schedule
    for sha256, n_stale in Counter(drawn_from).items():
        changes = _changes(protocol, content_file(study, sha256), sha256)
        are = "is" if n_stale == 1 else "are"
        yield (
            f"{study.protocol}: {changes} since the draw: {n_stale} of {n_schedules} "
            f"schedules {are} stale"
        )


def _changes(protocol: Protocol, file: Path, sha256: str) -> str:
    drawn = file.read_bytes() if file.is_file() else b""
    if hashlib.sha256(drawn).hexdigest() != sha256:
        return (
            "a key of the study id, scale, elbow, models, schedule, stretch, "
            "presentation, occasions or device has changed"
        )
    before, now = (
        dict(_leaves(json.loads(text))) for text in (drawn, presented_content(protocol))
    )
    # of a model that is new or gone its place in the list says all
    gone = {k for k in before.keys() ^ now.keys() if k.startswith("models.")}
    both = {k.split(".")[1] for k in before if k.startswith("models.")} & {
        k.split(".")[1] for k in now if k.startswith("models.")
    }
    keys = [
        key
        for key in [*now, *(key for key in before if key not in now)]
        if before.get(key, _NOT_SET) != now.get(key, _NOT_SET)
        and (key not in gone or key.split(".")[1] in both)
    ]
    shown = [
        f"{key} was {_text(before.get(key, _NOT_SET))} and is "
        f"{_text(now.get(key, _NOT_SET))}"
        for key in keys[:_SHOWN]
    ]
    more = len(keys) - _SHOWN
    return ", ".join(shown) + (f", and {more} more keys differ" if more > 0 else "")


def _leaves(content: Any, place: str = "") -> Iterator[tuple[str, object]]:
    # keys of a document with dots between; models by their ids, and the list of these
    if place == "models":
        yield place, [model["id"] for model in content]
        content = {model["id"]: model for model in content}
    if isinstance(content, dict):
        for key, value in content.items():
            yield from _leaves(value, f"{place}.{key}".lstrip("."))
    else:
        yield place, content


def _text(value: object) -> str:
    return "not set" if value is _NOT_SET else json.dumps(value, ensure_ascii=False)
