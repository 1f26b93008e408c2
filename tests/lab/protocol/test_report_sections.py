"""Which sections a report has: those that are named, or all there is something for."""

import msgspec

from masrel.lab.protocol import Protocol, protocol_hash, report_sections
from tests.lab.analysis.studies import hess2012, plan

FORMER = (
    "design",
    "grades",
    "agreement",
    "intended",
    "test-retest",
    "speeds",
    "traces",
)


def with_sections(sections: tuple[str, ...] | None, **tables: object) -> Protocol:
    protocol = msgspec.structs.replace(hess2012(), **tables)
    report = msgspec.structs.replace(protocol.report, sections=sections)
    return msgspec.structs.replace(protocol, report=report)


def test_without_a_choice_a_report_tells_what_a_study_has_something_for() -> None:
    protocol, story = hess2012(), report_sections(with_sections(None))
    assert (story[0], story[-1]) == ("design", "methods")
    # what no study asks for by saying nothing, or this one has nothing for
    assert {"in-person", "claims", "sample-size"}.isdisjoint(story)
    assert {*FORMER} < {*story}
    models = tuple(
        msgspec.structs.replace(model, intended_grade=None) for model in protocol.models
    )
    analysis = msgspec.structs.replace(protocol.analysis, estimates=(plan(),))
    bare = with_sections(None, models=models, analysis=analysis, questionnaires=())
    gone = {"test-retest", "confusion", "questionnaires"}
    assert gone < {*story}
    assert report_sections(bare) == tuple(name for name in story if name not in gone)
    for names in (FORMER, ("methods", "design"), ()):
        assert report_sections(with_sections(names)) == names


def test_no_choice_hashes_as_the_sections_that_once_were_the_default() -> None:
    assert protocol_hash(with_sections(None)) == protocol_hash(with_sections(FORMER))
    assert protocol_hash(with_sections(())) != protocol_hash(with_sections(FORMER))
