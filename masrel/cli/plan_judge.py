"""``masrel plan --judge``: how many items a judge needs, to pass or for a rate."""

from dataclasses import asdict
from typing import Any

import click

from masrel._input import refuse
from masrel.cli._options import (
    OutputOptions,
    floats,
    output_options,
    write_output,
)


@click.command("plan --judge")
@click.option(
    "--epsilon", type=float, help="How much worse than a human the judge may be."
)
@click.option(
    "--raters", "n_humans", type=int, help="Number of humans who grade every item."
)
@click.option(
    "--accuracy",
    type=floats,
    metavar="SHARES",
    help="How often a human and the judge are right, as 0.9,0.85; one number means "
    "both.",
)
@click.option("--categories", "n_categories", default=2, show_default=True)
@click.option(
    "--power", default=0.8, show_default=True, help="Probability that the judge passes."
)
@click.option("--seed", "rng", default=0, show_default=True)
@click.option("--rate", type=float, help="Expected rate, instead of --epsilon.")
@click.option("--sensitivity", type=float, help="Sensitivity of the judge, for --rate.")
@click.option("--specificity", type=float, help="Specificity of the judge, for --rate.")
@click.option("--half-width", type=float, help="Half-width of the interval of --rate.")
@click.option(
    "--level", default=0.95, show_default=True, help="Level of this interval."
)
@click.option(
    "--items",
    "n_items",
    type=int,
    help="For --rate, the number of items that the judge grades; otherwise the number "
    "that all grade, and the power is given.",
)
@output_options(
    json='Write JSON to this file; "-" writes it to standard output and '
    "prints nothing else."
)
def plan_judge(output: OutputOptions, **options: Any) -> None:
    """Find how many items must be labelled for a judge.

    With --epsilon, the command gives the number of items that a judge and the humans
    must all grade for the judge to pass the alternative annotator test of masrel judge
    with the probability --power, from 1000 simulated studies. With --rate, it gives the
    number of --items that need a label for an interval of ± --half-width around the
    rate, corrected for the judge's errors.
    """
    needed = {
        "epsilon": ("n_humans", "accuracy"),
        "rate": ("sensitivity", "specificity", "half_width", "n_items"),
    }
    aims = [name for name in needed if options[name] is not None]
    refuse((len(aims) != 1, "--epsilon, --rate: needed one of them"))
    names = {param.name: param.opts[0] for param in plan_judge.params}
    absent = [str(names[name]) for name in needed[aims[0]] if options[name] is None]
    refuse((absent, f"{', '.join(absent)}: needed with --{aims[0]}"))
    from masrel import judges

    if aims == ["rate"]:
        keys = (*needed["rate"], "rate", "level")
        n_labels = judges.labels_needed(**{key: options[key] for key in keys})
        document = {"n_labels": n_labels, **{key: options[key] for key in keys}}
        text = (
            f"Labels for {n_labels} of {options['n_items']} items give an interval of "
            f"the rate with an expected half-width of {options['half_width']:g}."
        )
    else:
        human, *judge = options["accuracy"]
        keys = ("epsilon", "n_humans", "n_categories", "n_items", "power", "rng")
        plan = judges.judge_plan(
            human_accuracy=human,
            judge_accuracy=judge[0] if judge else None,
            **{key: options[key] for key in keys},
        )
        document = asdict(plan)
        text = (
            f"With {plan.n_items} items that {options['n_humans']} humans and the "
            f"judge grade, the judge passes at ε = {options['epsilon']:g} in "
            f"{100.0 * plan.power:.0f} % of studies (Monte Carlo error "
            f"{100.0 * plan.monte_carlo_error:.1f})."
        )
    write_output(output, document=lambda: document, text=lambda: text)
