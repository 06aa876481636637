"""The APA sits beside the axis of the two joints ([STB] 6.2: the encoder's spurious modes at 200 and 285 Hz depend on
dy and dx; an offset turns the axial force into a bending moment)."""

from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="misalignment",
    title="Misalignment of the APA",
    does="moves the APA off the axis of the joints",
    parameters=(
        Parameter(
            "dx_um",
            lo=-600.0,
            hi=600.0,
            scale=20.0,
            begins=(-120.0, 120.0),  # from nothing, two of seven units ended with a wrong sign
            sets=("misalignment.dx_um",),
        ),
        Parameter("dy_um", lo=-1500.0, hi=1500.0, scale=50.0, begins=(-200.0, 200.0), sets=("misalignment.dy_um",)),
    ),
    channels=("de",),
    sign="the strut's bending modes appear or vanish in de alone; da and Vs hardly change",
    sentence="The APA sits {dx_um} um (x) and {dy_um} um (y) beside the axis of the joints.",
    sources=("[STB] 6.2",),
    experiment=Experiment.TURN,
)
