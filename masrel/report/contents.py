"""Which sections there are: only those a protocol names are made."""

from collections.abc import Callable

from masrel.report.accuracy import in_person_section, intended_section
from masrel.report.agreement import agreement_section, retest_section
from masrel.report.design import design_section, grades_section
from masrel.report.material import Material, Section
from masrel.report.speeds import speeds_section
from masrel.report.traces import traces_section

__all__ = ["SECTIONS", "build_sections"]

SECTIONS: dict[str, Callable[[Material], Section]] = {
    "design": design_section,
    "grades": grades_section,
    "agreement": agreement_section,
    "intended": intended_section,
    "in-person": in_person_section,
    "test-retest": retest_section,
    "speeds": speeds_section,
    "traces": traces_section,
}
"""Name in ``report.sections`` to what makes it."""


def build_sections(material: Material) -> tuple[Section, ...]:
    """Make the sections a protocol asks for, in its order."""
    return tuple(SECTIONS[name](material) for name in material.protocol.report.sections)
