"""A person at a page gives the grades: what the console asks, as messages."""

import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, ClassVar

from masrel.errors import ParameterError, SessionLogError
from masrel.lab.protocol import PresentationRules
from masrel.lab.protocol._values import Answer, checked_answer
from masrel.lab.run import (
    GradeCorrection,
    GradeRequest,
    QuestionRequest,
    Skip,
    StretchGrade,
)
from masrel.lab.run.console import _stopped
from masrel.lab.serve._channel import Channel, Message
from masrel.scales import Scale, published_scale

if TYPE_CHECKING:
    from masrel.lab.hess import EmergencyStop

Fields = dict[str, Any]


class PageGrades:
    """A person at a page, who is told positions and blinded codes only."""

    name: ClassVar[str] = "browser"
    simulated: ClassVar[bool] = False

    def __init__(self, channel: Channel, scale: Scale) -> None:
        self._channel = channel
        self._scale = scale
        self._n_asked = 0
        self._last: tuple[str, str | None] | None = None  # code and grade as it is
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
    def listening(self, request: GradeRequest, stop: "EmergencyStop") -> Iterator[None]:
        """Let the page press the stop, or say done, while a model is presented."""
        with self._news:
            self._presented = request, stop
            # it may have been pressed since the rater began
            self._came = deque(
                message
                for message in self._came
                if not _is_for_now(message, request, stop)
            )
        self._channel.send(
            {
                "kind": "presenting",
                "screen": "presenting",
                **_place(request),
                "may_say_done": may_say_done(request.rules),
                "samples": str(request.samples),
            }
        )
        try:
            yield
        finally:
            with self._news:
                self._presented = None

    def make_ready(self, request: GradeRequest) -> None:
        """Wait until the rater begins."""
        self._last = request.last
        last, grades = _as_fields(request.last), list(self._scale.grades)
        self._ask(request, "ready", _only("begin", True), last=last, grades=grades)

    def grade(self, request: GradeRequest) -> str | StretchGrade | None:
        """Return the grade; None to feel it again."""
        published = published_scale(self._scale)
        meanings = {} if published is None else published.meanings
        remarks = [request.ended] if request.ended in _LIMITS else []
        if request.felt not in ("felt", None):
            remarks.append("too-slow")
        if request.grip_lost:
            remarks.append("grip-lost")
        chosen: StretchGrade | None = self._ask(
            request,
            "grade",
            lambda message: self._checked_grade(request, message),
            scale=self._scale.name,
            grades=[
                {"grade": grade, "meaning": meanings.get(grade)}
                for grade in self._scale.grades
            ],
            meanings_source=None if published is None else published.source,
            n_stretches=request.n_stretches,
            remarks=remarks,
        )
        return chosen

    def _checked_grade(
        self, request: GradeRequest, message: Message
    ) -> StretchGrade | None:
        if message.get("again") is True:
            return None
        grade, stretch = message.get("grade"), message.get("stretch")
        if not isinstance(grade, str) or grade not in self._scale.grades:
            needed = ", ".join(self._scale.grades)
            raise ParameterError(f"grade: needed one of {needed}, got {grade!r}")
        numbers = range(1, request.n_stretches + 1)
        if stretch is not None and (type(stretch) is not int or stretch not in numbers):
            raise ParameterError(
                f"stretch: needed one of {request.n_stretches}, from 1, got {stretch!r}"
            )
        return StretchGrade(grade=grade, stretch=stretch)

    def present_again(self, request: GradeRequest, fault: str) -> bool | Skip:
        """Return whether to present it again after a fault, or that it is skipped."""

        def checked(message: Message) -> bool | Skip:
            why, again = message.get("skip"), message.get("again")
            if isinstance(why, str) and why.strip() and request.may_skip:
                return Skip(who=request.rater, why=why.strip())
            if not isinstance(again, bool):
                raise ParameterError("needed whether to present it again, or why not")
            return again

        with self._news:  # one press too many: the arm is at rest
            self._came = deque(x for x in self._came if x["kind"] != "stop")
        chosen: bool | Skip = self._ask(
            request, "fault", checked, why=fault, may_skip=request.may_skip
        )
        return chosen

    def instruct(self, request: GradeRequest, text: str) -> None:
        """Return when the rater has read the instructions."""
        self._ask(request, "instructions", _only("go_on", True), text=text.strip())

    def take_break(self, request: GradeRequest, minutes: float) -> None:
        """Return when a break is over."""
        self._ask(request, "break", _only("go_on", True), minutes=minutes)

    def begins_anew(self, request: GradeRequest, days: int) -> bool:
        """Return whether a session begins anew that was left so many days ago."""

        def checked(message: Message) -> bool:
            anew = message.get("anew")
            if not isinstance(anew, bool):
                raise ParameterError("needed whether the session begins anew")
            return anew

        anew: bool = self._ask(request, "anew", checked, days=days)
        return anew

    def answer(self, request: QuestionRequest) -> Answer:
        """Return the answer to a question, or None for none."""
        question = request.question

        def checked(message: Message) -> Answer:
            answer = message.get("answer")
            if not isinstance(answer, str | int | float | None):
                raise ParameterError(f"answer: needed {question.needed}")
            return checked_answer(question, answer, where="answer")

        answer: Answer = self._ask(
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
        return answer

    def _ask(
        self,
        request: GradeRequest | QuestionRequest,
        screen: str,
        checked: Callable[[Message], Any],
        **fields: Any,
    ) -> Any:
        # what `checked` makes of the answer; what it refuses is asked again
        self._n_asked += 1
        ask = {"kind": "ask", "n": self._n_asked, "screen": screen}
        self._channel.send({**ask, **_place(request), **fields})
        while True:
            message = self._next_answer(request)
            try:
                return checked(message["answer"])
            except ParameterError as error:
                refused = {"kind": "refused", "n": self._n_asked, "why": f"{error}"}
                self._channel.send(refused)

    def _next_answer(self, request: GradeRequest | QuestionRequest) -> Message:
        # What came before the session is left counts: a page was told that it would
        while True:
            with self._news:
                self._news.wait_for(lambda: self._came)
                message = self._came.popleft()
            kind = message["kind"]
            if kind == "answer" and message["n"] == self._n_asked:
                return message
            if kind == "correct":
                self._correct(request, message)
            elif kind == "stop":
                why = f"by an emergency stop ({message['who']})"
                raise _stopped(request, why)
            elif kind == "leave":
                raise _stopped(request, message.get("why", "on request"))

    def _correct(
        self, request: GradeRequest | QuestionRequest, message: Message
    ) -> None:
        which = {"id": message["id"]}
        names = ("code", "grade", "who", "why")
        correction = GradeCorrection(**{name: message[name] for name in names})
        try:
            if request.correct is None:
                raise ParameterError("needed a session whose grades can be corrected")
            request.correct(correction)
        except (ParameterError, SessionLogError) as error:
            self._channel.send({"kind": "not-corrected", **which, "why": f"{error}"})
            return
        if self._last is not None and self._last[0] == correction.code:
            self._last = correction.code, correction.grade
        last = _as_fields(self._last)
        self._channel.send({"kind": "corrected", **which, "last": last})


_LIMITS = ("time-limit", "max-duration")

_GONE = {"kind": "leave", "why": "as the server is gone", "who": "server gone"}


def _is_for_now(message: Message, request: GradeRequest, stop: "EmergencyStop") -> bool:
    # heeds what is about the presentation that goes on -> whether that was all
    kind, status = message["kind"], request.status
    if kind == "stop" or message is _GONE:
        stop.press(message["who"])
    elif kind == "done" and status is not None and may_say_done(request.rules):
        status.done()
    return kind in ("stop", "done")


def _as_fields(last: tuple[str, str | None] | None) -> Fields | None:
    return None if last is None else {"code": last[0], "grade": last[1]}


def may_say_done(rules: PresentationRules) -> bool:
    """Return whether a rater says at the page that a presentation is over."""
    return rules.stretches != 1 and rules.done_with == "enter"


def _only(key: str, value: object) -> Callable[[Message], None]:
    # an answer that says just that
    def checked(message: Message) -> None:
        if message.get(key) is not value:
            raise ParameterError(f"needed {key} = {value}")

    return checked


def _place(request: GradeRequest | QuestionRequest) -> Fields:
    # what is asked about: never which model it is
    shown = request.presentation
    place: Fields = {"code": None if shown is None else shown.code}
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
