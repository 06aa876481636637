"""The simulated strut on its bench: from the description of a model file to poles, responses and records.

    model = build_model(load_model("strut-2dof"))  # the text of a model file, parsed by `specs.model`
    model = model.with_values({"bench.payload_kg": 5.9})  # flat names; the unit is the end of the name
    H = model.frf(f)  # (F, C) complex, per volt of Va at the DAC, of model.channels
    f_Hz, damping = frequency_and_damping(model.poles())
    plant = StateSpace.of(model)
    y = time_simulation(model, Va.size, fs=10_000.0)(Va)["de"]  # (N,) [m]
    sweep_parameters(model, ["joint.kz_N_per_um"], [75.0, 250.0], "Vs", f).table

`model.sds` has the standard deviations of uncertain values. A model with an impossible value raises a `ModelError`."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from checks.model.build import build_model, file_nodes
    from checks.model.channel_paths import LATENCIES
    from checks.model.electrical import highpass_corner
    from checks.model.free_apa_modes import ModalApa
    from checks.model.learned_bench import LearnedBench
    from checks.model.model import Model, frequency_and_damping, frequency_grid
    from checks.model.parameter_sweep import PUBLISHED_SWEEPS, sweep_parameters
    from checks.model.structure.attached import ELEMENT
    from checks.model.structure.superelement import Superelement
    from checks.model.time.hysteresis_creep import loops_of, stroke_of
    from checks.model.time.partial_fractions import Fractions
    from checks.model.time.state_space import StateSpace
    from checks.model.time.time_response import time_simulation
    from checks.model.unidentified import UnidentifiedElement
else:
    __getattr__ = door(__name__)
