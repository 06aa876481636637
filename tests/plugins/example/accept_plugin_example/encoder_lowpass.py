"""The encoder's interpolator filters its signals: a first-order lag on de alone."""

import numpy as np

from checks.gap import Parameter
from checks.gap.modelling.effect import Effect, spread
from checks.gap.modelling.experiment import Experiment
from checks.model.time.partial_fractions import real_pole

EFFECT = Effect(
    name="encoder_lowpass",
    title="Filter of the encoder's interpolator",
    parameters=(
        Parameter(
            "f_Hz", lo=50.0, hi=1e5, off=float("inf"), start=2000.0, scale=100.0, grid=spread(200.0, 20_000.0, 10)
        ),
    ),
    channels=("de",),
    sign="de alone loses magnitude and phase as behind a first-order lag",
    sentence="The encoder's interpolator filters de from {f_Hz} Hz on.",
    sources=("data sheet of the interpolator",),
    experiment=Experiment.POINT,
    factor=lambda values, s: 1.0 / (1.0 + s / (2.0 * np.pi * values["f_Hz"])),
    path=lambda values: real_pole(2.0 * np.pi * values["f_Hz"]),
)
