"""The piezo's hysteresis: a loop between drive and displacement whose width grows with the amplitude and does not
depend on the rate ([STB], section 3.1.6; Bertotti, Hysteresis in Magnetism, 1998, 2.3 for Rayleigh's loops)."""

from checks.gap.modelling.effect import Effect, Parameter

EFFECT = Effect(
    name="hysteresis",
    title="Hysteresis of the drive",
    parameters=(Parameter("relative_width", 0.0, 0.5, 0.0, 0.0, 0.01),),
    channels=("de",),
    sign="the loop under slow sines opens in proportion to the amplitude",
    sentence="The drive has hysteresis: loops open by {relative_width} of the stroke at the largest amplitude.",
    record="slow",
)
