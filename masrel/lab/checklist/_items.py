"""What a checklist is: items, each filled, filled in part, or left to the authors."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

State = Literal["filled", "in part", "authors"]
"""Who fills an item: the record, both, or the authors alone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ChecklistItem:
    """One item of a guideline.

    Attributes
    ----------
    number : str
        Its number in the guideline.
    topic : str
        What it asks for, in our words.
    state : {"filled", "in part", "authors"}
        Whether the record of the study answers it.
    facts : tuple of str
        What the record says, one sentence or more each.
    to_add : str
        What the authors have to add; empty where nothing.
    sources : tuple of Path
        The files that say so, from the study's folder.
    """

    number: str
    topic: str
    state: State
    facts: tuple[str, ...] = ()
    to_add: str = ""
    sources: tuple[Path, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Checklist:
    """A guideline with what the record of a study says to each of its items.

    Attributes
    ----------
    guideline : str
        Its short name, of `GUIDELINES`.
    title : str
        Its name.
    reference : str
        Where it is published.
    study : str
        The title of the study.
    items : tuple of ChecklistItem
        In the guideline's order.
    notes : tuple of str
        What a reader must know before the items.
    files : mapping of str to str
        SHA-256 of each file that an item names.
    masrel_version : str
        The version that filled it.
    """

    guideline: str
    title: str
    reference: str
    study: str
    items: tuple[ChecklistItem, ...]
    notes: tuple[str, ...]
    files: Mapping[str, str] = field(hash=False)
    masrel_version: str
