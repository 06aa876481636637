"""Drive and sensor share a return wire: the current of the actuator stacks, C dV/dt, drops a voltage on it, which adds
to Vs in proportion to frequency (common impedance, [OTT09] ch. 3). tau = R C: 0.3 ohm and 10 uF are 3 us, and against
the sign that Vs has below its zero they turn that zero to the other side.

The capacitance between the cables does not do this: above 0.4 Hz the sensor stack is a capacitor of 5 uF, so they
divide the drive by the same number at every frequency. That is `crosstalk`."""

from checks.gap.modelling.effect import Effect, Parameter
from checks.gap.modelling.experiment import Experiment

EFFECT = Effect(
    name="sensor_pickup",
    title="Common return of drive and sensor",
    does="adds tau times the derivative of the amplifier's output (20 Va) to Vs",
    parameters=(Parameter("tau_us", label="coupling", lo=-1000.0, hi=1000.0, scale=0.1, sets=("sensor.pickup_us",)),),
    channels=("Vs",),
    sign="the zeros of Vs move, its poles stay; what is missing grows in proportion to frequency",
    sentence="The derivative of the amplifier's output, times {tau_us} us, adds to Vs: drive and sensor share a return "
    "wire (0.1 ohm beside stacks of 10 uF: 1 us).",
    earlier=("The derivative of the amplifier's output, times {tau_us} us, adds to Vs.",),
    sources=("[OTT09] ch. 3",),
    experiment=Experiment.OWN_RETURN,
)
