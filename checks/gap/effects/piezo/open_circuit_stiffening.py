"""A stack without a path for its charge is stiffer ([IEEE176] 2; [STB] 3.1.8: 2.3 N/um open and 1.7 connected)."""

from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="open_circuit_stiffening",
    title="Stiffening by the open circuit",
    does="stacks without a path for their charge are stiffer",
    parameters=(Parameter("ratio", lo=-0.5, hi=5.0, scale=0.02, sets=("apa.sensor_stiffening",)),),
    channels=("Vs", "da"),
    sign="the axial mode and the zero of Vs move up together, with less motion per volt",
    sentence="The sensor stack, open, is stiffer by {ratio} (relative).",
    sources=("[IEEE176] 2", "[STB] 3.1.8"),
    experiment=Experiment.RESISTOR,
)
