"""How far a volt of Va moves an actuator."""

# um per volt at the DAC. Two stacks move 1.43 um per volt over their whole range ([STB] 2.3), 28.6 behind the amplifier
# of 20; small signals move less, by up to a third ([STB] 4.2: 17.5); one stack alone half of that.
GAIN_UM_PER_V = [15.0, 40.0]


def wrong_gain(channel: str, gain: float, lo: float, hi: float) -> str:
    """Words for a gain [um/V] that is not that of two stacks behind the amplifier."""
    return (
        f"{channel} moves {gain:.3g} um per volt of Va, expected {lo:g} to {hi:g}: a stack does not work, or the gain "
        "of the amplifier or the scale of the channels is wrong"
    )
