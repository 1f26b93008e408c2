"""Sections `flow` and `conduct`: what became of the raters, and what happened."""

import statistics
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from masrel._input import check_option, listed
from masrel.lab._event_log import Event
from masrel.lab.conduct import PlanChange, plan_changes, read_conduct
from masrel.lab.conduct._calibrations import Calibration, last_calibration
from masrel.lab.conduct._study_log import conduct_hash
from masrel.lab.progress import (
    RaterProgress,
    SessionProgress,
    open_sessions,
    rater_progress,
    session_progress,
)
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.protocol._values import field_heading
from masrel.lab.ratings import Correction, corrections_of, study_remarks
from masrel.lab.report._material import FIGURES, Material
from masrel.lab.schedule.presentation import Schedule, _read_drawn
from masrel.pages._sections import Content, Drawing, Paragraph
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import INTERIM, Column, Table, Value, counted, table_of

_WHO, _NOTES = "who", "notes"
"""What `include` may name beside fields of raters."""

_LISTED = ("withdrawn", "excluded", "included", "unblinded", "noted", "merged")


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyConduct:
    """What a report says of how a study was run.

    Attributes
    ----------
    sessions : tuple of SessionProgress
        Where every session stands.
    raters : tuple of RaterProgress
        What became of every rater.
    events : tuple of Event
        What happened beside the sessions, in order of time.
    corrections : tuple of Correction
        Grades that were corrected.
    remarks : tuple of str
        What a reader must know of the sessions.
    changes : tuple of PlanChange
        What has changed in the plan since the first draw of schedules.
    schedules : tuple of Schedule
        The schedules of sessions that have begun.
    has_published_secret : bool
        Whether the secret that schedules were drawn from is published.
    is_of_ratings : bool
        Whether the ratings of the report are those of the session logs.
    sha256 : str or None
        Of what happened beside the sessions; None for nothing.
    calibration : tuple of Calibration and str, or None
        The last of the device, and the hash of its file; None where it has none.
    include : frozenset of str
        What is shown though it is private.
    """

    sessions: tuple[SessionProgress, ...]
    raters: tuple[RaterProgress, ...]
    events: tuple[Event, ...]
    corrections: tuple[Correction, ...]
    remarks: tuple[str, ...]
    changes: tuple[PlanChange, ...]
    schedules: tuple[Schedule, ...]
    has_published_secret: bool
    is_of_ratings: bool
    sha256: str | None
    calibration: tuple[Calibration, str] | None
    include: frozenset[str]

    @property
    def begun(self) -> tuple[SessionProgress, ...]:
        """The sessions that have begun."""
        return tuple(s for s in self.sessions if s.last_event is not None)

    @property
    def goes_on(self) -> bool:
        """Whether a session is still to come of a rater who takes part."""
        return bool(open_sessions(self.sessions, self.raters))

    @property
    def interim(self) -> str:
        """How many sessions are complete, while others are awaited; else nothing."""
        n_complete = sum(session.stage == "complete" for session in self.sessions)
        text = f"{INTERIM}: {n_complete} of {counted(len(self.sessions), 'session')}"
        return text * bool(self.begun and self.goes_on)

    @property
    def inputs(self) -> dict[str, str]:
        """What the manifest of a report says of it: a hash, and what is shown."""
        sha256 = {} if self.sha256 is None else {"conduct_sha256": self.sha256}
        shown = {"include": " ".join(sorted(self.include))} if self.include else {}
        device = self.calibration and {"calibration_sha256": self.calibration[1]}
        return sha256 | (device or {}) | shown


def study_conduct(
    study: StudyPaths,
    protocol: Protocol,
    *,
    file: Path | None = None,
    include: Collection[str] = (),
) -> StudyConduct | None:
    """Gather what a report says of how a study was run.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    file : Path, optional
        A table of ratings that is used whatever the session logs say.
    include : collection of str, optional
        What is shown though it is private: ``"who"`` (who recorded each event),
        ``"notes"`` (texts and reasons), or fields of raters.

    Returns
    -------
    StudyConduct or None
        For `write_report`; None of a study that was not run.

    Raises
    ------
    ParameterError
        If `include` names anything else.
    SessionLogError
        If a log is damaged.
    """
    for name in include:
        check_option("include", name, (_WHO, _NOTES, *protocol.rater_fields))
    if not (study.sessions.is_dir() or study.conduct_logs()):
        return None
    sessions = session_progress(study, protocol)
    begun = [session for session in sessions if session.last_event is not None]
    names = [(session.rater, session.session) for session in begun]
    drawn = _read_drawn(study, names, skips_damaged=True)
    return StudyConduct(
        sessions=sessions,
        raters=rater_progress(study, protocol, sessions),
        events=tuple(e for e in read_conduct(study) if e.kind in _LISTED),
        # a table named by hand is not the logs'
        corrections=corrections_of(study, protocol) if file is None else (),
        remarks=study_remarks(
            study, protocol, file=file, has_conduct=False, include=include
        ),
        changes=plan_changes(study, protocol),
        schedules=tuple(schedule for _, schedule in drawn),
        has_published_secret=study.published_secret_file.is_file(),
        is_of_ratings=bool(begun) and file is None,
        sha256=conduct_hash(study),
        calibration=last_calibration(
            study, protocol, simulated=all(session.simulated for session in begun)
        ),
        include=frozenset(include),
    )


def flow_section(material: Material) -> Iterator[Content]:
    """Say what became of the raters, once one has begun."""
    conduct = material.conduct
    if conduct and conduct.begun:
        yield _flow_table(material, conduct)
        yield _flow_figure(material, conduct)
        yield from _characteristics(material, conduct)


def conduct_section(material: Material) -> Iterator[Content]:
    """Say what happened, as far as it is known."""
    conduct = material.conduct
    if conduct is None:
        return
    yield from _device_calibration(material, conduct)
    if conduct.events:
        yield _events_table(material, conduct)
    if conduct.corrections:
        yield _corrections_table(material, conduct)
    if conduct.changes:
        yield _changes_table(material, conduct)
    yield from (Paragraph(text=text) for text in conduct.remarks)
    if left_out := "; ".join(_left_out(material, conduct)):
        yield Paragraph(
            text=f"Not shown: {left_out}. To show one, add --include and the word in "
            "parentheses to masrel report."
        )


def _device_calibration(material: Material, conduct: StudyConduct) -> Iterator[Content]:
    device = material.protocol.device.backend
    if conduct.calibration is not None:
        calibration, _ = conduct.calibration
        yield Paragraph(
            text=f"{'SIMULATED: ' * calibration.simulated}calibration of the device, "
            f"{device}, on {calibration.time_utc:%Y-%m-%d}, with 95 % intervals: "
            f"{'; '.join(calibration.lines)}. Torque gain from "
            f"{calibration.gain_from or 'nothing: it was not measured'}."
        )
    elif any(not session.simulated for session in conduct.begun):
        yield Paragraph(text=f"The device, {device}, was never calibrated.")


def _flow(
    material: Material, conduct: StudyConduct, session: str | None = None
) -> dict[str, list[str]]:
    # the raters of each step, of a session or of the whole study
    stages: dict[str, set[str]] = {rater.rater: set() for rater in conduct.raters}
    for each in conduct.sessions:
        if session in (None, each.session):
            stages[each.rater].add(each.stage)
    raters = [rater for rater in conduct.raters if stages[rater.rater]]
    graded = {
        row.rater
        for row in material.ratings.rows
        if row.grade is not None and session in (None, row.session)
    }
    return {
        "planned": [r.rater for r in raters],
        "begun": [r.rater for r in raters if stages[r.rater] & {"begun", "complete"}],
        "complete": [r.rater for r in raters if stages[r.rater] == {"complete"}],
        # who left after a session was complete, not in that one
        "withdrawn": [
            r.rater
            for r in raters
            if r.status == "withdrawn"
            and (session is None or stages[r.rater] != {"complete"})
        ],
        "excluded": [r.rater for r in raters if r.status == "excluded"],
        "late": [r.rater for r in raters if r.is_late],
        "analysed": [*graded - set(material.analysis.excluded)],
    }


def _flow_table(material: Material, conduct: StudyConduct) -> Table:
    sessions = [session.id for session in material.protocol.sessions]
    flows = [(of or "study", _flow(material, conduct, of)) for of in (*sessions, None)]
    return Table(
        name="rater_flow",
        caption="Number of raters, from planned to analysed",
        columns=(
            Column(key="session", heading="Session", align="left"),
            *(Column(key=key, heading=key.capitalize()) for key in flows[0][1]),
        ),
        rows=tuple((name, *map(len, flow.values())) for name, flow in flows),
        notes=(
            "Complete in the row study: complete in all sessions. Late: joined after "
            "the site's first draw of schedules. Analysed: with a grade, not excluded.",
        ),
        data=material.data,
    )


def _flow_figure(material: Material, conduct: StudyConduct) -> Drawing:
    flow = _flow(material, conduct)
    planned, begun, complete = (flow[key] for key in ("planned", "begun", "complete"))
    left = [r for r in flow["withdrawn"] if r not in complete]
    # how many came so far, and what became of the others
    groups: dict[str, dict[str, Sequence[str]]] = {
        "planned": {"Late": flow["late"]},
        "begun": {"Not begun": [r for r in planned if r not in begun]},
        "complete": {
            "Withdrawn": left,
            "Not complete": [r for r in begun if r not in (*complete, *left)],
        },
        "analysed": {"Excluded": material.analysis.excluded},
    }
    steps = tuple(
        (
            f"{key.capitalize()}: {len(flow[key])}",
            [f"{k}: {len(r)} ({listed(r)})" for k, r in of.items() if r],
        )
        for key, of in groups.items()
    )
    shown = "; ".join(", ".join((label, *others)) for label, others in steps)
    return Drawing(
        name="rater_flow",
        caption="Flow of the raters."
        + " Raters who did not complete are analysed, too."
        * (not {*flow["analysed"]} <= {*complete}),
        alt=f"Flow of the raters. {shown}.",
        content=Drawn(FIGURES + "_study_figures:flow_figure", (steps,)),
        stamp=material.stamp,
    )


def _characteristics(material: Material, conduct: StudyConduct) -> Iterator[Table]:
    # of the raters who are analysed, in the fields that may be shown
    analysed = _flow(material, conduct)["analysed"]
    raters = [rater for rater in conduct.raters if rater.rater in analysed]
    numbers: list[tuple[Value, ...]] = []
    counts: list[tuple[Value, ...]] = []
    for name, field in material.protocol.rater_fields.items():
        known = [r.values[name] for r in raters if r.values[name] is not None]
        if not (field.public or name in conduct.include):
            continue
        if field.type in ("whole", "number"):
            numbers.append((field_heading(name, field), len(known), *_summary(known)))
        else:
            tally = Counter(map(str, known))
            counts += [
                (field_heading(name, field), text, n) for text, n in tally.items()
            ]
    if numbers:
        measures = {"mean": "Mean", "sd": "SD", "median": "Median"}
        measures |= {"least": "Min", "most": "Max"}
        yield Table(
            name="rater_numbers",
            caption="Characteristics of the analysed raters: numbers",
            columns=(
                Column(key="field", heading="Field", align="left"),
                Column(key="n", heading="Raters"),
                *(Column(key=k, heading=m, digits=2) for k, m in measures.items()),
            ),
            rows=tuple(numbers),
            notes=("SD: n − 1.",),
            data=material.data,
        )
    if counts:
        yield Table(
            name="rater_counts",
            caption="Characteristics of the analysed raters",
            columns=(
                Column(key="field", heading="Field", align="left"),
                Column(key="value", heading="Value", align="left"),
                Column(key="n", heading="Raters"),
            ),
            rows=tuple(counts),
            data=material.data,
        )


def _summary(known: Sequence[object]) -> tuple[Value, ...]:
    numbers = [float(value) for value in known if isinstance(value, int | float)]
    if not numbers:
        return (None,) * 5
    sd = statistics.stdev(numbers) if len(numbers) > 1 else None
    middle = statistics.median(numbers)
    return (statistics.fmean(numbers), sd, middle, min(numbers), max(numbers))


def _events_table(material: Material, conduct: StudyConduct) -> Table:
    keys = ["date", "event", "rater", "session", "details"]
    names = {key: key.capitalize() for key in keys}
    return table_of(
        "events",
        "Other events of the study, in chronological order",
        [*_columns(names | {"who": "By"} if _WHO in conduct.include else names)],
        [
            {
                **event.fields,
                "who": event.fields.get("who") or None,
                "date": event.fields.get("on") or event.time_utc[:10],
                "event": event.fields["kind"] if event.kind == "noted" else event.kind,
                "details": "; ".join(_details(event, _NOTES in conduct.include))
                or None,
            }
            for event in conduct.events
        ],
        data=material.data,
    )


def _details(event: Event, has_texts: bool) -> Iterator[str]:
    # what else is said of an event
    fields = event.fields
    if event.kind == "merged":
        yield f"the folder {fields['name']}"
    if event.kind == "unblinded":
        yield "all codes" if fields["code"] is None else f"code {fields['code']}"
    if has_texts:
        yield from (str(fields[name]) for name in ("text", "why") if name in fields)
    for name in (
        "severity",
        "seriousness",
        "relatedness",
        "onset",
        *(("action", "outcome") if has_texts else ()),
    ):
        if fields.get(name) is not None:
            yield f"{name}: {fields[name]}"


def _corrections_table(material: Material, conduct: StudyConduct) -> Table:
    columns = [
        *_columns({"rater": "Rater", "session": "Session", "model": "Model"}),
        Column(key="repeat", heading="Repeat"),
        Column(key="first_grade", heading="First", align="center"),
        Column(key="grade", heading="Corrected", align="center"),
        *_private_columns(conduct),
    ]
    if material.ratings.is_sealed:
        columns = [each for each in columns if each.key not in ("model", "repeat")]
    return table_of(
        "corrections",
        "Corrected grades",
        columns,
        [asdict(each) for each in conduct.corrections],
        notes=(
            "Corrections are in chronological order; the last one of a presentation "
            "counts. First: the grade that the rater gave; –: no grade.",
        ),
        data=material.data,
    )


def _changes_table(material: Material, conduct: StudyConduct) -> Table:
    names = {"key": "Key", "before": "Before", "after": "After"}
    names["recorded"] = "Recorded"
    return table_of(
        "plan_changes",
        "Changes to the plan since the first draw of schedules",
        [*_columns(names), *_private_columns(conduct)],
        [
            {
                **asdict(change),
                "before": change.before or "not planned",
                "after": change.after or "no longer planned",
                "recorded": (change.time_utc or "no")[:10],
            }
            for change in conduct.changes
        ],
        data=material.data,
    )


def _columns(names: Mapping[str, str]) -> Iterator[Column]:
    # of text, by key and heading
    yield from (Column(key=k, heading=name, align="left") for k, name in names.items())


def _private_columns(conduct: StudyConduct) -> Iterator[Column]:
    # why something was recorded and by whom, where that is to be shown
    names = {"why": ("Reason", _NOTES), "who": ("By", _WHO)}
    return _columns(
        {k: of for k, (of, name) in names.items() if name in conduct.include}
    )


def _left_out(material: Material, conduct: StudyConduct) -> Iterator[str]:
    texts = [e for e in conduct.events if {"text", "why"} & {*e.fields}]
    named = [e for e in conduct.events if "who" in e.fields]
    amended = any(change.who for change in conduct.changes)
    if (named or amended or conduct.corrections) and _WHO not in conduct.include:
        yield f"who recorded events and corrections ({_WHO})"
    if (texts or amended or conduct.corrections) and _NOTES not in conduct.include:
        yield f"texts of notes, deviations and adverse events, and reasons ({_NOTES})"
    for name, field in material.protocol.rater_fields.items():
        is_known = any(rater.values[name] is not None for rater in conduct.raters)
        if is_known and not field.public and name not in conduct.include:
            yield f"the field {field_heading(name, field)} of raters ({name})"
