"""The process of one session: ``python -m masrel.lab.serve._session_process``.

It is started with the number of a connected socket and what to run, as JSON. Messages
go to and fro as JSON objects, one a line: what a person at a page is asked and answers.
"""

import contextlib
import hashlib
import json
import socket
import sys
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from masrel.errors import (
    MasrelError,
    ParameterError,
    SessionLogError,
    SessionLogInUseError,
    SessionStoppedError,
)
from masrel.lab.hess import EmergencyStop
from masrel.lab.hess._clock import may_use
from masrel.lab.protocol import ScaleDefinition, StudyPaths, read_protocol
from masrel.lab.protocol._values import Answer, checked_answer
from masrel.lab.run._grade_sources import (
    GradeRequest,
    GradeSource,
    QuestionRequest,
    Skip,
    StretchGrade,
    checked_grade,
    remarks_on,
)
from masrel.lab.run.console import _stopped
from masrel.lab.run.session import run_session
from masrel.scales import Scale, published_scale

Message = dict[str, Any]
"""One message; ``kind`` says what it is."""

MAX_LINE = 1 << 20
"""Bytes of the longest line that is read."""

_Checked = TypeVar("_Checked")

_OTHER_ENDS_S = 10.0  # within this a process ends whose server is gone
_GONE = {"kind": "leave", "why": "because the server stopped", "who": "server gone"}


def encoded(message: Message) -> bytes:
    """Return a message as a line."""
    return json.dumps(message, ensure_ascii=False).encode() + b"\n"


class Channel:
    """The end of the process of a session; anybody may send, one thread receives."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._sending = threading.Lock()

    def send(self, kind: str, **fields: Any) -> None:
        """Send a message; nothing where nobody is there any more."""
        with self._sending, contextlib.suppress(OSError):
            self._connection.sendall(encoded({"kind": kind, **fields}))

    def received(self) -> Iterator[Message]:
        """Yield messages until the other end is gone."""
        with contextlib.suppress(OSError), self._connection.makefile("rb") as lines:
            while line := lines.readline(MAX_LINE):
                if not line.endswith(b"\n"):
                    return  # torn: the other end died while it wrote
                yield json.loads(line)


class PageGrades(GradeSource):
    """A person at a page, who is told positions and blinded codes only."""

    name: ClassVar[str] = "browser"
    simulated: ClassVar[bool] = False

    def __init__(
        self, channel: Channel, scale: ScaleDefinition, *, rehearsal: bool
    ) -> None:
        self._channel = channel
        self._scale = scale
        self._rehearsal = rehearsal
        self._ask_id = ""  # what identifies the question
        # What came and was not yet heeded, in order; guarded by the condition
        self._news = threading.Condition()
        self._came: deque[Message] = deque()
        self._presented: tuple[GradeRequest, EmergencyStop] | None = None
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        for message in self._channel.received():
            self._take_in(message)
        self._take_in(_GONE)  # the arm comes to rest, the session ends

    def _take_in(self, message: Message) -> None:
        with self._news:
            if self._presented is not None:
                if _is_for_now(message, *self._presented):
                    return
            elif message["kind"] == "done":
                return  # late: it is over already
            self._came.append(message)
            self._news.notify()

    @contextmanager
    def listening(self, request: GradeRequest, stop: EmergencyStop) -> Iterator[None]:
        """Let the page press the stop, or say done, while a model is presented."""
        with self._news:
            self._presented = request, stop
            # it may have been pressed since the rater began
            self._came = deque(
                message
                for message in self._came
                if not _is_for_now(message, request, stop)
            )
        place = {"screen": "presenting", **_place(request)}
        more = {"may_say_done": _may_say_done(request), "samples": str(request.samples)}
        self._channel.send("presenting", **place, **more)
        try:
            yield
        finally:
            with self._news:
                self._presented = None

    def make_ready(self, request: GradeRequest) -> None:
        """Wait until the rater begins."""
        last, grades = None, list(self._scale.grades)
        if request.last is not None:
            last = dict(zip(("code", "grade"), request.last, strict=True))
        self._ask(request, "ready", _only("begin"), last=last, grades=grades)

    def grade(self, request: GradeRequest) -> str | StretchGrade | None:
        """Return the grade; None to feel it again."""
        # never a word of masrel's own, which would be taken for the scale's
        scale = Scale(name=self._scale.name, grades=self._scale.grades)
        published = published_scale(scale)
        return self._ask(
            request,
            "grade",
            lambda message: self._checked_grade(request, message),
            scale=scale.name,
            grades=scale.grades,
            anchors=self._scale.anchors,
            source=published and f"{published.title}. {published.source}",
            n_stretches=request.n_stretches,
            remarks=remarks_on(request),
        )

    def _checked_grade(
        self, request: GradeRequest, message: Message
    ) -> StretchGrade | None:
        if message.get("again") is True:
            return None
        grade, stretch = message.get("grade"), message.get("stretch")
        return checked_grade(request, self._scale.grades, grade, stretch)

    def present_again(self, request: GradeRequest, fault: str) -> bool | Skip:
        """Return whether to present it again after a fault, or that it is skipped."""

        def checked(message: Message) -> bool | Skip:
            why = message.get("skip")
            if isinstance(why, str) and why.strip() and request.may_skip:
                return Skip(who=request.rater, why=why.strip())
            return _truth(message, "again", "to present it again, or why not")

        with self._news:  # one press too many: the arm is at rest
            self._came = deque(x for x in self._came if x["kind"] != "stop")
        return self._ask(
            request, "fault", checked, why=fault, may_skip=request.may_skip
        )

    def instruct(self, request: GradeRequest, text: str) -> None:
        """Return when the rater has read the instructions."""
        self._ask(request, "instructions", _only("go_on"), text=text.strip())

    def take_break(self, request: GradeRequest, minutes: float) -> None:
        """Return when a break is over."""
        self._ask(request, "break", _only("go_on"), minutes=minutes)

    def begins_anew(self, request: GradeRequest, days: int) -> bool:
        """Return whether a session that was left `days` ago starts again."""

        def checked(message: Message) -> bool:
            return _truth(message, "anew", "the session begins again")

        return self._ask(request, "anew", checked, days=days)

    def answer(self, request: QuestionRequest) -> Answer:
        """Return the answer to a question, or None for none."""
        question = request.question

        def checked(message: Message) -> Answer:
            answer = message.get("answer")
            if not isinstance(answer, str | int | float | None):
                raise ParameterError(f"answer: needed {question.needed}")
            return checked_answer(question, answer, where="answer")

        return self._ask(
            request,
            "question",
            checked,
            questionnaire=request.questionnaire.title,
            question=f"{request.questionnaire.id}.{question.id}",
            text=question.text,
            type=question.type,
            choices=list(question.choices),
            range=question.range,
            low_label=question.low_label,
            high_label=question.high_label,
            required=question.required,
            needed=question.needed,
            number=1 + request.questionnaire.questions.index(question),
            n_questions=len(request.questionnaire.questions),
        )

    def _ask(
        self,
        request: GradeRequest | QuestionRequest,
        screen: str,
        checked: Callable[[Message], _Checked],
        **fields: Any,
    ) -> _Checked:
        # what `checked` makes of the answer; what it refuses is asked again
        shown = {"screen": screen, **_place(request), **fields}
        # the same where the session goes on in another process
        keys = ("screen", "code", "attempt", "practice", "question", "position")
        which = (request.rater, request.session, self._rehearsal, *map(shown.get, keys))
        self._ask_id = hashlib.sha256(json.dumps(which).encode()).hexdigest()[:24]
        self._channel.send("ask", ask=self._ask_id, **shown)
        while True:
            message = self._next_answer(request)
            try:
                return checked(message["answer"])
            except ParameterError as error:
                self._channel.send("refused", why=f"{error}")

    def _next_answer(self, request: GradeRequest | QuestionRequest) -> Message:
        # What came before the session is left counts: a page was told that it would
        while True:
            with self._news:
                self._news.wait_for(lambda: self._came)
                message = self._came.popleft()
            match message:
                case {"kind": "answer", "ask": self._ask_id}:
                    return message
                case {"kind": "correct", **fields}:
                    self._correct(request, fields)
                case {"kind": "stop"}:
                    why = f"by an emergency stop ({message['who']})"
                    raise _stopped(request, why)
                case {"kind": "leave"}:
                    raise _stopped(request, message.get("why", "on request"))

    def _correct(
        self, request: GradeRequest | QuestionRequest, correction: Message
    ) -> None:
        try:
            if request.correct is None:
                raise ParameterError("needed a session whose grades can be corrected")
            request.correct(**correction)
        except (ParameterError, SessionLogError) as error:
            self._channel.send("not-corrected", why=f"{error}")
            return
        self._channel.send("corrected", **correction)


def _is_for_now(message: Message, request: GradeRequest, stop: EmergencyStop) -> bool:
    # heeds what is about the presentation that goes on -> whether that was all
    kind, status = message["kind"], request.status
    if kind == "stop" or message is _GONE:
        stop.press(message["who"])
    elif kind == "done" and status is not None and _may_say_done(request):
        status.done()
    return kind in ("stop", "done")


def _may_say_done(request: GradeRequest) -> bool:
    # whether a rater says at the page that a presentation is over
    return request.rules.stretches != 1 and request.rules.done_with == "enter"


def _only(key: str) -> Callable[[Message], None]:
    # an answer that says just that
    def checked(message: Message) -> None:
        if message.get(key) is not True:
            raise ParameterError(f"needed {key} = True")

    return checked


def _truth(message: Message, key: str, meaning: str) -> bool:
    value = message.get(key)
    if not isinstance(value, bool):
        raise ParameterError(f"needed whether {meaning}")
    return value


def _place(request: GradeRequest | QuestionRequest) -> Message:
    # what is asked about: never which model it is
    shown = request.presentation
    place: Message = {"code": None if shown is None else shown.code}
    if isinstance(request, QuestionRequest):
        return place
    rules = request.rules
    return {
        **place,
        "position": request.presentation.position,
        "n_presentations": request.n_presentations,
        "attempt": request.attempt,
        "practice": request.practice,
        "rehearsal": request.rehearsal,
        "rules": {
            "stretches": rules.stretches,
            "slow_speed_deg_s": rules.slow_speed_deg_s,
            "fast_speed_deg_s": rules.fast_speed_deg_s,
            "time_limit_s": rules.time_limit_s,
            "done_with": rules.done_with,
        },
    }


def main(arguments: list[str]) -> None:
    """Run a session, and say how it ended."""
    order = json.loads(arguments[0])
    may_use(order["processors"])
    channel = Channel(socket.socket(fileno=order["socket"]))

    def note(message: Warning | str, *_: object) -> None:
        channel.send("note", text=f"{message}")

    warnings.showwarning = note  # type: ignore[assignment]
    try:
        how, text = "complete", _run(channel, order)
    except SessionStoppedError as error:
        how, text = "stopped", f"{error}"
    except (MasrelError, OSError) as error:
        how, text = "failed", f"{error}"
    channel.send("over", how=how, text=text)


def _run(channel: Channel, order: Message) -> str:
    # what is said of a session that is complete
    study = StudyPaths(Path(order["study"]))
    protocol = read_protocol(study.protocol)
    grades = PageGrades(channel, protocol.scale, rehearsal=order["rehearsal"])
    until = time.monotonic() + _OTHER_ENDS_S
    while True:
        try:
            summary = run_session(
                *(study, protocol, order["rater"], order["session"]),
                grades=grades,
                clock=order["clock"],
                rehearsal=order["rehearsal"],
            )
            return f"session {summary.session} of {summary.rater} is complete"
        except SessionLogInUseError:
            if time.monotonic() > until:
                raise
            time.sleep(0.05)


if __name__ == "__main__":
    main(sys.argv[1:])
