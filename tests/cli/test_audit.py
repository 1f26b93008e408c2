"""masrel audit: what a report says of the claims of a study."""

import hashlib
from pathlib import Path

from masrel.lab.protocol import copy_template
from tests.cli.process import Caller


def test_a_report_that_names_them_has_the_claims(
    masrel: Caller, tmp_path: Path
) -> None:
    root = tmp_path / "study"
    copy_template("hess2012", root)
    protocol = root / "protocol.toml"
    head = protocol.read_text(encoding="utf-8").partition("[[analysis.estimates]]")[0]
    protocol.write_text(head + '\n[report]\nsections = ["claims"]\n', encoding="utf-8")
    claims = root / "ratings" / "claims.csv"
    for kappa, words in (("0.771", "agree on 10 of 12"), ("0.772", "no table of 12")):
        claims.write_text(
            f"name,n_items,n_categories,kappa,kappa_weights\nretest,12,4,{kappa},identity\n"
        )
        assert masrel("report", root, "--quiet").code == 0
        page = (root / "report" / "report.md").read_text(encoding="utf-8")
        assert "Published numbers" in page
        assert words in page
        digest = hashlib.sha256(claims.read_bytes()).hexdigest()
        assert digest in page
    claims.unlink()
    assert masrel("report", root, "--quiet").code == 0
    page = (root / "report" / "report.md").read_text(encoding="utf-8")
    assert "there is no ratings/claims.csv" in page
