"""Voltages and bands of the bench, once: what is driven, what can be recorded, where the gain is the static one."""

STACK_V = (-20.0, 150.0)  # of the stacks ([STB] 2.3)
DAC_V = (-10.0, 10.0)  # of the converters
RECORDED_V = 10.5  # largest voltage that a converter of +-10 V records, with overrange
STATIC_HZ = (10.0, 20.0)  # [STB] 4.2.3: below the resonance, the gain is the static one
