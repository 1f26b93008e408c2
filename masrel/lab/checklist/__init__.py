"""Checklists of reporting guidelines, filled from the record of a study.

In: a study. Out: the items of a guideline, each with what masrel knows of it and the
files that say so; what only the authors know is left to them.
"""

from masrel.lab.checklist._guidelines import (
    GUIDELINES,
    Checklist,
    ChecklistItem,
    checklist_markdown,
    fill_checklist,
    write_checklist,
)

__all__ = [
    "GUIDELINES",
    "Checklist",
    "ChecklistItem",
    "checklist_markdown",
    "fill_checklist",
    "write_checklist",
]
