"""Sections made for tests, before they are written."""

from masrel.lab.report._document import SECTIONS
from masrel.lab.report._material import Material
from masrel.pages._sections import Section


def build_sections(material: Material) -> list[Section]:
    return [SECTIONS[name](material) for name in material.protocol.report.sections]
