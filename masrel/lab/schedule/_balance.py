"""How even drawn schedules are: places, neighbours and runs, counted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

from masrel.errors import ScheduleError
from masrel.lab.protocol import Model, Protocol, StudyPaths
from masrel.lab.schedule._sites import checked_site, site_of
from masrel.lab.schedule.presentation import Schedule, check_schedule
from masrel.lab.schedule.sheets import read_schedule


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

    @property
    def n_with_repeats(self) -> int:
        """Schedules in which a model comes twice in a row."""
        return sum(run > 1 for run in self.model_runs)


def order_balance(
    protocol: Protocol, study: StudyPaths, site: str | None = None
) -> tuple[OrderBalance, ...]:
    """Count the drawn schedules of a study, or of one of its sites."""
    checked_site(protocol, site)
    drawn: dict[tuple[str, str | None], list[Schedule]] = {}
    for session in protocol.sessions:
        for rater in session.raters:
            file, at = study.schedule_file(rater, session.id), site_of(protocol, rater)
            if site in (None, at) and file.exists():
                schedule = read_schedule(file)
                check_schedule(schedule, protocol)
                drawn.setdefault((session.id, at), []).append(schedule)
    if not drawn:
        raise ScheduleError(f"{study.schedules}: needed drawn schedules, got none")
    return tuple(
        _balance(protocol, schedules, *group) for group, schedules in drawn.items()
    )


def _balance(
    protocol: Protocol, schedules: Sequence[Schedule], session: str, site: str | None
) -> OrderBalance:
    models = {model.id: model for model in protocol.models}
    orders = [[shown.model for shown in each.presentations] for each in schedules]
    number = {name: index for index, name in enumerate(models)}
    places = [[0] * len(orders[0]) for _ in models]
    pairs = [[0] * len(models) for _ in models]
    for order in orders:
        for place, name in enumerate(order):
            places[number[name]][place] += 1
        for name, following in pairwise(order):
            pairs[number[name]][number[following]] += 1
    grades = {name: model.intended_grade for name, model in models.items()}
    return OrderBalance(
        session=session,
        site=site,
        models=tuple(models),
        n_schedules=len(orders),
        places=tuple(map(tuple, places)),
        pairs=tuple(map(tuple, pairs)),
        model_runs=tuple(_longest(order, {m: m for m in models}) for order in orders),
        grade_runs=tuple(_longest(order, grades) for order in orders),
        standard_runs=tuple(_longest(order, _standards(models)) for order in orders),
    )


def _standards(models: Mapping[str, Model]) -> dict[str, str | None]:
    return {
        name: model.role if model.role == "standard" else None
        for name, model in models.items()
    }


def _longest(order: Sequence[str], kinds: Mapping[str, str | None]) -> int:
    """Return the longest run of models of one kind; those of None are of no kind."""
    runs = groupby(order, key=kinds.__getitem__)
    return max((len(list(run)) for kind, run in runs if kind is not None), default=0)
