"""The APA sits beside the axis of the two joints ([STB], sections 5.2 and 6.3: the encoder's spurious modes at 200 and
285 Hz depend on dy and dx; an offset turns the axial force into a bending moment)."""

from checks.gap.modelling.effect import Effect, Parameter

EFFECT = Effect(
    name="misalignment",
    title="Misalignment of the APA",
    parameters=(
        Parameter("dx_um", -600.0, 600.0, 0.0, 0.0, 20.0),
        Parameter("dy_um", -1500.0, 1500.0, 0.0, 0.0, 50.0),
    ),
    channels=("de",),
    sign="the strut's bending modes appear or vanish in de alone; da and Vs hardly change",
    sentence="The APA sits {dx_um} um (x) and {dy_um} um (y) beside the axis of the joints.",
)
