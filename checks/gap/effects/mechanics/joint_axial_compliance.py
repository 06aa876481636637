"""The joints are softer or stiffer along their axis than in the model ([STB] 6.3.2: the axial stiffness moves the zero
near 500 Hz; 94 N/um by finite elements, 70 in a later model)."""

from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="joint_axial_compliance",
    title="Axial compliance of the joints",
    does="axial stiffness of the joints",
    parameters=(
        Parameter(
            "kz_N_per_um",
            lo=5.0,
            hi=1000.0,
            off=float("nan"),
            start=90.0,
            scale=8.0,
            sets=("joint.kz_N_per_um", "joint.bottom.kz_N_per_um", "joint.top.kz_N_per_um"),
            grid=(30.0, 45.0, 65.0, 140.0, 220.0),
        ),
    ),
    channels=("da", "Vs"),
    sign="da and the zeros of de between the axial modes move, Vs at high frequency follows",
    sentence="The axial stiffness of the joints is {kz_N_per_um} N/um; the model expects another value.",
    sources=("[STB] 6.3.2",),
    experiment=Experiment.MASS,
)
