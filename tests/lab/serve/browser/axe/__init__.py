"""axe-core 4.14.1, which holds a page against rules of accessibility.

`axe.min.js` and its licences are as they came from npm; tests alone have them.
"""

from pathlib import Path

from playwright.sync_api import Page

SOURCE = Path(__file__).with_name("axe.min.js").read_text(encoding="utf-8")

RUN = """async () => {
    const {violations} = await axe.run();
    return violations.flatMap(({id, help, nodes}) =>
        nodes.map((node) => `${id}: ${help}: ${node.html}`));
}"""


def violations(page: Page) -> list[str]:
    """Return which rules are broken, and by which element."""
    if not page.evaluate("'axe' in window"):
        page.evaluate(SOURCE)
    broken: list[str] = page.evaluate(RUN)
    return broken
