"""Capacitance of the sensor stack and of the two actuator stacks at 1 kHz ([STB] 2.2)."""

from checks.acceptance.common.typed_value import typed_quantity
from checks.declare import Check, Form, Guide, Scalar, Values
from checks.quantity import Outcome
from specs.spec import CheckSpec

LEAST_UF, MOST_UF = 0.01, 100.0  # below: the meter's open leads, or farads; above: nF; a stack has about 5 uF


def measure(values: Values, spec: CheckSpec) -> Outcome:
    """Return the two readings of the LCR meter [uF], small signal at 1 kHz, with their stated uncertainty."""
    return Outcome(tuple(typed_quantity(values, spec, name) for name in CHECK.quantities))


PICTURE = """\
   LCR meter, 1 kHz
    H ──┬────────┐
        │  ┌─────┴─────┐
    L ─┐│  │ 1 sensor  │
       ││  ├───────────┤
       │└──┤ 2 ┐ drive │ 2 and 3 in
       └───┤ 3 ┘       │ parallel
           └───────────┘
   first 1 alone, then 2 with 3"""

CHECK = Check(
    name="capacitance",
    title="Capacitance of the stacks at 1 kHz",
    short="Capacitance",
    kinds=("apa",),
    forms=(
        Form(
            "values",
            (
                Scalar("sensor_uF", "sensor stack", lo=LEAST_UF, hi=MOST_UF),
                Scalar("actuator_uF", "the two actuator stacks in parallel", lo=LEAST_UF, hi=MOST_UF),
            ),
        ),
    ),
    quantities={"sensor_uF": "Sensor stack", "actuator_uF": "Actuator stacks"},
    measure=measure,
    stated=("sensor_uF", "actuator_uF"),
    failed="check that the leads are on the right stacks and the meter measures at 1 kHz; "
    "if it stays, a stack is wrong",
    guide=Guide(
        "Discharge the stacks: short them briefly. Set the LCR meter to 1 kHz and measure the sensor stack alone. "
        "Then measure the two actuator stacks in parallel.",
        PICTURE,
        drive="none; disconnect the amplifier",
        lit={"sensor_uF": ("1 sensor",), "actuator_uF": ("2 ┐ drive", "3 ┘")},
    ),
)
