"""How even drawn schedules are: places, neighbours and runs, counted."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, groupby, pairwise

from masrel.errors import ScheduleError
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.schedule._secret import checked_site, rater_sessions_at, site_of
from masrel.lab.schedule.presentation import Schedule, _read_drawn, check_schedule


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderBalance:
    """Counts over the schedules of a session, and of a site where sites are strata."""

    session: str
    site: str | None
    models: tuple[str, ...]
    n_schedules: int
    # how often a model stands in a place, a row each
    places: tuple[tuple[int, ...], ...]
    # how often a model, a row each, is followed by another at once
    pairs: tuple[tuple[int, ...], ...]
    # of each schedule, the longest run of a model, of an intended grade, of standards
    model_runs: tuple[int, ...]
    grade_runs: tuple[int, ...]
    standard_runs: tuple[int, ...]

    @property
    def n_places(self) -> int:
        """Presentations of one schedule."""
        return len(self.places[0])

    @property
    def of_others(self) -> tuple[int, ...]:
        """Counts of ordered pairs of two models."""
        return tuple(
            freq
            for i, row in enumerate(self.pairs)
            for j, freq in enumerate(row)
            if i != j
        )


def order_balance(
    protocol: Protocol, study: StudyPaths, site: str | None = None
) -> tuple[OrderBalance, ...]:
    """Count the drawn schedules of a study, or of one of its sites."""
    pairs = rater_sessions_at(protocol, checked_site(protocol, site))
    drawn: dict[tuple[str, str | None], list[Schedule]] = {}
    for _, schedule in _read_drawn(study, pairs):
        check_schedule(schedule, protocol)
        group = schedule.session, site_of(protocol, schedule.rater)
        drawn.setdefault(group, []).append(schedule)
    if not drawn:
        raise ScheduleError(f"{study.schedules}: needed drawn schedules, got none")
    return tuple(
        _balance(protocol, schedules, *group) for group, schedules in drawn.items()
    )


def _balance(
    protocol: Protocol, schedules: Sequence[Schedule], session: str, site: str | None
) -> OrderBalance:
    orders = [[shown.model for shown in each.presentations] for each in schedules]
    models = [model.id for model in protocol.models]
    places = Counter(chain.from_iterable(map(enumerate, orders)))
    pairs = Counter(chain.from_iterable(map(pairwise, orders)))
    grades = {model.id: model.intended_grade for model in protocol.models}
    standards = {
        model.id: model.role if model.role == "standard" else None
        for model in protocol.models
    }
    runs = [
        tuple(_longest(order, kinds) for order in orders)
        for kinds in ({model: model for model in models}, grades, standards)
    ]
    return OrderBalance(
        session=session,
        site=site,
        models=tuple(models),
        n_schedules=len(orders),
        places=tuple(
            tuple(places[place, model] for place in range(len(orders[0])))
            for model in models
        ),
        pairs=tuple(
            tuple(pairs[model, following] for following in models) for model in models
        ),
        model_runs=runs[0],
        grade_runs=runs[1],
        standard_runs=runs[2],
    )


def _longest(order: Sequence[str], kinds: Mapping[str, str | None]) -> int:
    """Return the longest run of models of one kind; those of None are of no kind."""
    runs = groupby(order, key=kinds.__getitem__)
    return max((len(list(run)) for kind, run in runs if kind is not None), default=0)
