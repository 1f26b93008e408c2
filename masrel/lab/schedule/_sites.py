"""The sites of a study, where they are strata."""

from masrel.errors import ScheduleError
from masrel.lab.protocol import Protocol


def site_of(protocol: Protocol, rater: str) -> str | None:
    """Return the site of a rater where sites are strata; else None."""
    if protocol.schedule.strata == "none":
        return None
    return {each.id: each.site for each in protocol.raters}[rater]


def checked_site(protocol: Protocol, site: str | None) -> str | None:
    """Return a site that the protocol has, and by which it draws; refuse any other."""
    if site is None:
        return None
    if protocol.schedule.strata != "site":
        raise ScheduleError(
            'site: needed schedule.strata = "site" in the protocol, got '
            f'"{protocol.schedule.strata}"'
        )
    sites = dict.fromkeys(rater.site for rater in protocol.raters if rater.site)
    if site not in sites:
        raise ScheduleError(f"site: needed one of {', '.join(sites)}, got {site!r}")
    return site
