"""Section `claims`: what a paper printed of the study, held against every table."""

import hashlib
from dataclasses import dataclass

from masrel.audit import Claim, audit_claim, read_claims
from masrel.lab._bounded_files import MAX_TABLE, read_regular
from masrel.lab.protocol import Protocol, StudyPaths, report_sections
from masrel.lab.report._material import Material
from masrel.pages._sections import Section, absent_section
from masrel.tables._claims_table import claims_table, readings_table

_TITLE = "Published numbers"


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedClaims:
    """What a paper printed of a study, as `published_claims` reads it.

    Attributes
    ----------
    claims : tuple of Claim
        Each number that was printed, with the tables that it may come from.
    sha256 : str
        Hash of the file that says so.
    """

    claims: tuple[Claim, ...]
    sha256: str

    @property
    def inputs(self) -> dict[str, str]:
        """The file, as inputs of a report are named."""
        return {"claims_sha256": self.sha256}


def published_claims(paths: StudyPaths, protocol: Protocol) -> PublishedClaims | None:
    """Read what a paper printed of a study, for the section ``claims`` of its report.

    Parameters
    ----------
    paths : StudyPaths
        The study's files; numbers are in its ``ratings/claims.csv``.
    protocol : Protocol
        The study's protocol.

    Returns
    -------
    PublishedClaims or None
        None where the report is to have no such section, or there is no such file.

    Raises
    ------
    RatingsError
        If the file is not one of claims; the message names row and column.
    OSError
        If it cannot be read.

    Examples
    --------
    >>> from pathlib import Path
    >>> from masrel.lab.protocol import StudyPaths, read_protocol
    >>> from masrel.lab.report import published_claims
    >>> paths = StudyPaths(Path("studies/small"))
    >>> print(published_claims(paths, read_protocol(paths.protocol)))
    None
    """
    file = paths.claims_file
    if "claims" not in report_sections(protocol) or not file.exists():
        return None
    data = read_regular(file, most=MAX_TABLE)
    return PublishedClaims(
        claims=read_claims(file), sha256=hashlib.sha256(data).hexdigest()
    )


def claims_section(material: Material) -> Section:
    """Show which tables give the numbers that were published."""
    if not material.claims:
        return absent_section("claims", _TITLE, "there is no ratings/claims.csv")
    audits = [audit_claim(claim) for claim in material.claims]
    tables = (claims_table(audits), readings_table(audits))
    return Section(name="claims", title=_TITLE, blocks=tables)
