"""Signals: responses of records and of hammers, resonances, excitations, disturbances; no check and no model.

    (low,) = RecordResponse.of_records([record], EstimatorSettings(f_lo=20.0, f_hi=500.0))  # the drive is "Va"
    low.frf.f, low.frf.H, low.frf.coherence, low.frf.var  # (F,) [Hz], (F, C) over the drive
    low.resonances["de"].f_Hz, low.resonances["de"].U_Hz  # k = 2
    bode(low.frf, low.ratios)  # panels to draw

    excitation = Rig(fs=10_000.0).sweep(10.0, 400.0, duration_s=5.0, amplitude_V=0.5)
    excitation.t, excitation.Va  # checked against the ranges of the DAC and the stacks

    hit = hammer_response(hammer_records, "Track1", "h1", 0.0, None, ImpactRules())
    [(m.f_Hz, m.U_Hz) for m in hit.modes["Track2"]]
    disturbance_notes(record)  # hum, bursts, a drive at its rail

A record that cannot be used raises a `RecordError`, a signal that must not be played an `ExcitationError`."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from checks.signals.disturbances import disturbance_notes
    from checks.signals.drive.excitation import Excitation, ExcitationError, Rig
    from checks.signals.drive.excitation_panels import excitation_panels
    from checks.signals.drive.shapes import Notch, amplitude_shape
    from checks.signals.impact.hammer_response import HammerTestResponse, hammer_response
    from checks.signals.impact.impacts import ImpactRules
    from checks.signals.mode_shifts import ModeShift
    from checks.signals.record_response import Estimator, EstimatorSettings, RecordResponse
    from checks.signals.sketch import Sketch
    from checks.signals.spectral.bode import bode
    from checks.signals.spectral.conjugate import conjugate_resonances
    from checks.signals.spectral.frf import Frf
    from checks.signals.spectral.recursion import integrated
else:
    __getattr__ = door(__name__)
