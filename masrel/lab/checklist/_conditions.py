"""What guidelines ask in common: order, blinding, independence, dates, conditions."""

from collections import Counter

from masrel.lab.checklist._facts import StudyFacts, days_between
from masrel.lab.schedule._orders import orders_in_words
from masrel.tables._tables import counted


def order_of_presentations(facts: StudyFacts) -> tuple[str, ...]:
    """Say how the order of presentations comes about."""
    order = "an order of their own, all orders equally likely"
    if facts.protocol.schedule.scheme != "random-order":
        order = orders_in_words(facts.protocol.schedule)
    return (
        f"In each session a rater meets the models in {order}; "
        f"{counted(facts.n_schedules, 'schedule')} drawn.",
    )


def blinding(facts: StudyFacts) -> tuple[str, ...]:
    """Say what hides the models from the raters, and what was unblinded."""
    if not facts.n_schedules:
        return ("No schedule is drawn: the record says nothing of blinding.",)
    concealed = (
        f"orders and codes of {facts.n_concealed} of {facts.n_schedules} schedules "
        "come from a secret that is not published"
    )
    unblinded = [text for text in facts.remarks if "unblinded" in text]
    known = unblinded or ["The record has no unblinding."]
    return (
        f"Raters meet models by codes that differ by rater and session; {concealed}.",
        *known,
    )


def independence(facts: StudyFacts) -> tuple[str, ...]:
    """Say what keeps the grades of one rater from another."""
    if not facts.sessions:
        return ("There are no session logs: the record says nothing of it.",)
    return (
        "Every session is of one rater, with codes and an order of its own; masrel "
        "shows no rater the grades of another, and a grade once given is changed by a "
        "correction only, of which the log has who, when and why.",
        *_on_paper(facts),
        f"{counted(len(facts.corrections), 'correction')} of a grade.",
    )


def _on_paper(facts: StudyFacts) -> tuple[str, ...]:
    n_sheets = sum(dict(each.header)["grades"] == "paper" for each in facts.sessions)
    if not n_sheets:
        return ()
    return (
        f"{counted(n_sheets, 'session')} on paper: sheets with codes, and no models; "
        "the log has who typed them.",
    )


def dates(facts: StudyFacts) -> tuple[str, ...]:
    """Say when the sessions were, and how far a rater's are from each other."""
    if not facts.sessions:
        return ("There are no session logs: dates and intervals are not known.",)
    days = [session.day for session in facts.sessions]
    span = f"Sessions began from {min(days)} to {max(days)} (UTC)."
    between = sorted(days_between(facts).elements())
    if not between:
        return (span, "No rater has two sessions.")
    middle = between[(len(between) - 1) // 2]
    return (
        span,
        f"Days between a rater's session and the next: {between[0]} to {between[-1]}, "
        f"median {middle}.",
    )


def conditions(facts: StudyFacts) -> tuple[str, ...]:
    """Say what was the same in all sessions, and what was not."""
    if not facts.sessions:
        return ("There are no session logs: conditions are not known.",)
    texts = []
    for position, (name, _) in enumerate(facts.sessions[0].header):
        counts = Counter(session.header[position][1] for session in facts.sessions)
        listed = "; ".join(f"{value} in {n}" for value, n in counts.items())
        texts.append(
            f"{_NAMES[name]}: {next(iter(counts))} in all sessions."
            if len(counts) == 1
            else f"{_NAMES[name]} differs: {listed}."
        )
    return tuple(texts)


_NAMES = {
    "device": "Device",
    "grades": "Grades from",
    "clock": "Clock of the device",
    "masrel_version": "Version of masrel",
    "presented_sha256": "SHA-256 of what is presented",
}
