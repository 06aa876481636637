"""Insulation between the stacks and the shell, as a megohmmeter shows it."""

from checks.acceptance.common.typed_value import typed_quantity
from checks.declare import Check, Form, Guide, Scalar, Values
from checks.quantity import Outcome
from specs.spec import CheckSpec

NAME = "insulation_ohm"


def measure(values: Values, spec: CheckSpec) -> Outcome:
    """The resistance [ohm] with its stated uncertainty."""
    return Outcome((typed_quantity(values, spec, NAME),))


CHECK = Check(
    name="insulation",
    title="Insulation between stacks and shell",
    kinds=("apa", "strut"),
    forms=(Form("value", (Scalar(NAME, "resistance between all leads and the shell", lo=0.0, hi=1e13),)),),
    quantities=(NAME,),
    measure=measure,
    stated=(NAME,),
    guide=Guide("Join all leads of the stacks. Measure between them and the shell at 100 V."),
)
