"""How far a volt of Va moves an actuator."""

# um per volt at the DAC. Two stacks move 1.43 um per volt over their whole range ([STB] 2.3), 28.6 behind the amplifier
# of 20; small signals move less, by up to a third ([STB] 4.2: 17.5); one stack alone half of that.
GAIN_UM_PER_V = [15.0, 40.0]
