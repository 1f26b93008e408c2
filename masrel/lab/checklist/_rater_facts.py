"""What is known of the raters, and how many went how far."""

import statistics
from collections import Counter
from collections.abc import Sequence

from masrel._input import listed
from masrel.lab.checklist._facts import StudyFacts
from masrel.tables._tables import counted, number


def rater_characteristics(facts: StudyFacts) -> tuple[str, ...]:
    """Say what the public fields of the raters hold, and which are not public."""
    texts, hidden = [], []
    for name, field in facts.protocol.rater_fields.items():
        known = [rater.values[name] for rater in facts.raters]
        values = [value for value in known if value is not None]
        title = field.title or name
        if not field.public:
            hidden.append(title)
        elif field.type in ("whole", "number"):
            texts.append(f"{title}: {_range(values, field.unit)}.")
        else:
            tally = Counter(map(str, values))
            counts = ", ".join(f"{n} {value}" for value, n in tally.items())
            texts.append(f"{title}: {counts or 'not known'}.")
    if hidden:
        texts.append(f"Kept, and not public: {listed(hidden)}.")
    return tuple(texts)


def _range(values: Sequence[object], unit: str) -> str:
    numbers = [float(value) for value in values if isinstance(value, int | float)]
    if not numbers:
        return "not known"
    ends = f"{number(min(numbers), None)} to {number(max(numbers), None)} {unit}"
    return f"{ends.strip()}, median {number(statistics.median(numbers), None)}"


def rater_flow(facts: StudyFacts) -> str:
    """Say how many raters were planned, and what became of them."""
    status = Counter(rater.status for rater in facts.raters)
    parts = [f"{n} {name}" for name, n in status.items() if name != "planned"]
    n_late = sum(rater.is_late for rater in facts.raters)
    late = f" {n_late} joined after the first draw of schedules." if n_late else ""
    n_begun = ", ".join(parts) or "none has begun"
    return f"{counted(len(facts.raters), 'rater')} planned: {n_begun}.{late}"
