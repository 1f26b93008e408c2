"""A training as a page that needs no other file: outcome, curve, tables."""

from masrel import __version__
from masrel.lab.protocol import Protocol, protocol_hash
from masrel.lab.report._material import SIMULATED_GRADES
from masrel.lab.report._pages import WRITERS
from masrel.lab.report._training_tables import (
    NOT_RATINGS,
    learning_view,
    outcome,
    training_stamp,
    training_tables,
)
from masrel.lab.training._lessons import TrainingRecord
from masrel.pages._sections import Block, Chapter, Document, Drawing, Paragraph
from masrel.plots import draw
from masrel.tables._tables import tag_of


def training_page(record: TrainingRecord, protocol: Protocol, *, level: float) -> bytes:
    """Return the page of a training; takes the level of its intervals."""
    curve, confusion = training_tables(record, level=level)
    drawing = Drawing(
        name="training",
        caption="Weighted kappa with the intended grades, as presentations went on; "
        "below, by how many grades each was too high",
        alt="Learning curve with its interval; the numbers are in the table below.",
        content=learning_view(record, level=level),
        stamp=training_stamp(record, protocol.study.id),
    )
    picture = draw(drawing.content, stamp=drawing.stamp, forms=("svg",))["svg"]
    blocks = (
        Block(number=1, content=Paragraph(text=NOT_RATINGS)),
        Block(number=1, content=drawing, pictures={"svg": picture}),
        Block(number=1, content=curve),
        Block(number=2, content=confusion),
    )
    document = Document(
        title=f"Training of {record.rater}",
        tag=tag_of(curve.data),
        banner=SIMULATED_GRADES[0] if record.simulated else "",
        provenance=f"Study {protocol.study.id}: {protocol.study.title}",
        result=f"Training of {record.rater}: {outcome(record)}.",
        sections=(Chapter(name="training", title="Training", blocks=blocks),),
        inputs=(("SHA-256 of the protocol", protocol_hash(protocol)),),
        version=__version__,
    )
    return WRITERS["html"].write(document)
