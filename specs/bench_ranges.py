"""Voltages, frequency bands and gains of the bench, stated once."""

STACK_V = (-20.0, 150.0)  # of the stacks ([STB] 2.3)
AMPLIFIER_GAIN = 20.0  # from the DAC to the stacks ([STB] 2.3, 3.1)
DAC_V = (-10.0, 10.0)  # of the converters
RECORDED_V = 10.5  # largest voltage that a converter of +-10 V records, with overrange
STATIC_HZ = (10.0, 20.0)  # [STB] 4.2.3: below the resonance, the gain is the static one
# um per volt at the DAC. Two stacks move 1.43 um per volt over their whole range ([STB] 2.3), 28.6 behind the amplifier
# of 20; small signals move less, by up to a third ([STB] 4.2: 17.5); one stack alone half of that.
GAIN_UM_PER_V = [15.0, 40.0]
