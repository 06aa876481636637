"""Spurious modes of the APA, one end fixed: bending in x and y, and the mode that a hit at the left excites and a hit
at the top does not; hammer and vibrometer ([STB] 2.4).

`z_torsion_Hz` is that third mode. Which mode it is has not been shown: [STB] 2.4.5 finds it at 800 Hz, prints "800 Hz?"
and "difficult to conclude". The public matrices of the frame, bottom end clamped, have bending at 294.6 Hz (x) and
525.2 Hz (y), the axial mode at 709.4 Hz, torsion at 1909 Hz and the next mode at 2381 Hz. The value is therefore
reported, and the built-in spec does not limit it; a bench that has shown which mode it is can limit it in its spec."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from checks.acceptance.common.sampling_rate import SAMPLING, remarks, vet_rates
from checks.acceptance.common.typed_value import stated_contribution
from checks.cause import Cause, Reason, because, record_label, together
from checks.declare import Check, Form, Guide, Series, Setting, Values
from checks.picture import Band, Item, Line, Mark, Panel
from checks.quantity import Contribution, Outcome, Quantity
from checks.record import Record
from checks.signals.impact.hammer import HammerTest, ImpactFrf, analyse
from checks.signals.impact.impact_response import fates
from checks.signals.impact.impacts import ImpactRules, impacts_panel, tally
from checks.signals.impact.modal_fit import Mode, amplitude_at, find_modes
from checks.signals.impact.progress import HitsSoFar, hits_so_far
from specs.spec import CheckSpec

HAMMER_RECORDS = ("x_bending", "y_bending", "torsion_left", "torsion_top")
HARMONICS = {"x_bending": (3, 5), "y_bending": (3,)}  # [STB] 2.4: 840 and 1400 Hz; 1220 Hz
FREE_FREE_Hz = {"x_bending": 189.0, "y_bending": 285.0}  # of the strut, by FEM ([STB], table 2.4)
_FREE_FREE_WORDS = {"x_bending": "bending in x", "y_bending": "bending in y"}
FRAME_Hz = (709.0, 1909.0)  # axial, torsion, of the frame with its bottom end clamped, by its public matrices
_THIRD_MODE = (
    "torsion about z: it is not known which mode {f_Hz:.4g} Hz is (finite elements: axial {axial:g} Hz, torsion "
    "{torsion:g} Hz); the value is reported and not judged"
)
HARMONIC_WITHIN = 0.05  # of the multiple: a mode further away is another one
SAME_MODE = 0.02  # apart; the place of the impact does not move a mode, and clamping again does so by less
IMPACTS_MIN = 3  # with fewer, their scatter is meaningless: a spec may require more, not fewer
CHANNELS = {"Track1": "N", "Track2": "rad"}


@dataclass(frozen=True, eq=False)
class HammerResponse:
    """Impacts of a record, the FRF of the good ones and its modes."""

    key: str
    record: Record
    test: HammerTest
    frf: ImpactFrf
    modes: tuple[Mode, ...]


@dataclass(frozen=True)
class SpuriousModesSettings:
    """Settings of the check."""

    impacts: ImpactRules
    impacts_min: int
    band_Hz: tuple[float, float]
    torsion_contrast: float


def measure(values: Values, spec: CheckSpec) -> Outcome:
    """Return frequency [Hz] and damping [percent of critical] of the three modes, harmonics of the bending modes [Hz].

    Each record gives its own quantities; a record that is missing or has too few good impacts does not affect the
    others. Torsion is the mode that the left impact shows and the top impact does not."""
    vet_rates(values, spec)
    rules = _rules(spec)
    analysed = {key: _analyse(key, values[key], rules) for key in HAMMER_RECORDS if key in values}
    found = {key: _modes_of(key, values, analysed, rules) for key in HAMMER_RECORDS}
    chosen: dict[str, Mode | Reason] = {}
    for key in ("x_bending", "y_bending"):
        response = found[key]
        chosen[key] = response if isinstance(response, Reason) else max(response.modes, key=lambda m: m.peak)
    chosen["z_torsion"] = _torsion(found, rules)
    quantities = [q for name, mode in chosen.items() for q in _quantities(name, mode, spec)]
    for name, orders in HARMONICS.items():
        quantities += [_harmonic(name, n, found[name], chosen[name], spec) for n in orders]
    tested = {key: a for key, a in analysed.items() if isinstance(a, HammerTest)}
    panels = _panels(
        values, tested, {k: f.modes for k, f in found.items() if isinstance(f, HammerResponse)}, rules.band_Hz
    )
    return Outcome(tuple(quantities), (*_notes(values, tested, found, chosen, spec), *remarks(values, spec)), panels)


def hammer_progress(record: Record, spec: CheckSpec, wanted: int = IMPACTS_MIN) -> HitsSoFar:
    """Return the hits of a running record, judged by the same rules. wanted: good hits, at least the spec's number."""
    rules = _rules(spec)
    needed, band = max(wanted, rules.impacts_min), _band(record, rules)
    return hits_so_far(record["Track1"], record["Track2"], record.fs, rules.impacts, needed, band)


def _rules(spec: CheckSpec) -> SpuriousModesSettings:
    get = {s.name: spec.settings.get(s.name, s.default) for s in SETTINGS}
    impacts = ImpactRules(
        level_ratio=get["level_ratio"],
        coherence_min=get["coherence_min"],
        force_range_N=get["force_range_N"] or None,
        double_hit_s=get["double_hit_ms"] / 1e3,
        double_hit_share=get["double_hit_share"],
        ringing_samples=get["ringing_samples"],
    )
    return SpuriousModesSettings(
        impacts, max(get["impacts_min"], IMPACTS_MIN), (get["lowest_Hz"], get["highest_Hz"]), get["torsion_contrast"]
    )


def _analyse(key: str, record: Record, rules: SpuriousModesSettings) -> HammerTest | Reason:
    band = _band(record, rules)
    if band[1] <= band[0]:
        return because(Cause.SAMPLING_SLOW, record=key, file=record.name, rate=record.fs, lowest=band[0])
    try:
        return analyse(record["Track1"], record["Track2"], record.fs, rules.impacts, band)
    except ValueError as e:
        return because(Cause.CANNOT_ESTIMATE, record=key, file=record.name, detail=str(e))


def _band(record: Record, rules: SpuriousModesSettings) -> tuple[float, float]:
    """Return the search band, below the cut-off of the analyser's filter."""
    return rules.band_Hz[0], min(rules.band_Hz[1], record.fs / 2.56)


def _modes_of(
    key: str, values: Values, analysed: dict[str, HammerTest | Reason], rules: SpuriousModesSettings
) -> HammerResponse | Reason:
    """Return the impacts, FRF and modes of a record, or the reason why it shows none."""
    if key not in analysed:
        return because(Cause.NOT_MEASURED, record=key)
    test = analysed[key]
    if isinstance(test, Reason):
        return test
    if not test.impacts:
        return because(Cause.NO_IMPACT, record=key)
    if test.frf is None or test.good < rules.impacts_min:
        faults = list(dict.fromkeys(i.fault for i in test.impacts if i.fault))
        return because(
            Cause.IMPACTS_BAD, record=key, tally=tally(test.impacts), needed=rules.impacts_min, faults=faults
        )
    band = _band(values[key], rules)
    modes = find_modes(test.frf, band)
    if not modes:
        return because(Cause.NO_MODE, record=key, lo=band[0], hi=band[1])
    return HammerResponse(key, values[key], test, test.frf, modes)


def _torsion(found: dict[str, HammerResponse | Reason], rules: SpuriousModesSettings) -> Mode | Reason:
    """Return the lowest mode that the left impact shows and the top impact leaves out, or the reason why none is found.

    A mode is left out when the top impact shows it weaker, by the stated contrast, than it shows the best seen of the
    others: a softer hit or another lever weakens all modes equally."""
    left, top = found["torsion_left"], found["torsion_top"]
    if isinstance(left, Reason):
        return left
    frequencies = ", ".join(f"{m.f_Hz:.4g}" for m in left.modes)
    if isinstance(top, Reason):
        return together([top, because(Cause.TORSION_WITHOUT_TOP, modes=frequencies)])
    if len(left.modes) < 2:
        return because(Cause.TORSION_ONE_MODE, record=left.key, modes=frequencies)
    if not any(abs(m.f_Hz / other.f_Hz - 1) <= SAME_MODE for m in left.modes for other in top.modes):
        others = ", ".join(f"{m.f_Hz:.4g}" for m in top.modes)
        return because(Cause.TORSION_OTHER_UNIT, record=top.key, others=others, modes=frequencies)
    ratios = np.array([_seen_by_top(top.frf, m) / m.peak for m in left.modes])
    gone = [m for m, r in zip(left.modes, ratios, strict=True) if r * rules.torsion_contrast <= ratios.max()]
    if not gone:
        return because(Cause.TORSION_NO_CONTRAST, record=top.key, modes=frequencies, needed=rules.torsion_contrast)
    return gone[0]


def _seen_by_top(frf: ImpactFrf, mode: Mode) -> float:
    """Return the largest amplitude of the mode that the top impact's record allows."""
    amplitude, u = amplitude_at(frf, mode)
    return amplitude + 2.0 * u


def _quantities(name: str, mode: Mode | Reason, spec: CheckSpec) -> tuple[Quantity, Quantity]:
    names = f"{name}_Hz", f"{name}_damping_percent"
    if isinstance(mode, Reason):
        return Quantity.missing(names[0], mode), Quantity.missing(names[1], mode)
    damping = _quantity(names[1], 100 * mode.damping_ratio, 100 * mode.u_damping, 100 * mode.u_damping_model, spec)
    return _quantity(names[0], mode.f_Hz, mode.u_Hz, mode.u_Hz_model, spec), damping


def _quantity(name: str, value: float, u: float, u_model: float, spec: CheckSpec, like: str = "") -> Quantity:
    """Return a quantity with its budget; like: the quantity whose stated uncertainty stands in for its own."""
    budget = [Contribution("scatter between impacts (half the 95 % t-interval)", u, "A")]
    if u_model > 0:
        budget.append(Contribution("neighbouring modes in the local fit", u_model))
    return Quantity.of(name, value, *budget, stated_contribution(spec, value, name, like))


def _harmonic(name: str, order: int, found: HammerResponse | Reason, first: Mode | Reason, spec: CheckSpec) -> Quantity:
    """Return the mode nearest to a multiple of the first one, if they agree within 5 %."""
    label = f"{name}_harmonic_{order}_Hz"
    if isinstance(found, Reason):
        return Quantity.missing(label, found)
    if isinstance(first, Reason):
        return Quantity.missing(label, first)
    wanted = order * first.f_Hz
    nearest = min(found.modes, key=lambda m: abs(m.f_Hz - wanted))
    if abs(nearest.f_Hz - wanted) > HARMONIC_WITHIN * wanted:
        return Quantity.missing(label, because(Cause.NO_HARMONIC, within=HARMONIC_WITHIN, f_Hz=wanted))
    return _quantity(label, nearest.f_Hz, nearest.u_Hz, nearest.u_Hz_model, spec, f"{name}_Hz")


def _notes(
    values: Values,
    tested: dict[str, HammerTest],
    found: dict[str, HammerResponse | Reason],
    chosen: dict[str, Mode | Reason],
    spec: CheckSpec,
) -> list[str]:
    notes = [
        f"{record_label(key)}: {fates(test.impacts, values[key].t)}"
        for key, test in tested.items()
        if test.good < len(test.impacts)
    ]
    notes += [
        f"{record_label(f.key)}: the decay is cut, an exponential window ends it; the "
        f"{f.frf.added_decay:.3g} 1/s that it adds to every decay is taken out"
        for f in found.values()
        if isinstance(f, HammerResponse) and f.frf.added_decay > 0
    ]
    left = found["torsion_left"]
    if isinstance(left, HammerResponse):
        others = ", ".join(f"{m.f_Hz:.4g}" for m in left.modes if m is not chosen["z_torsion"])
        notes.append(
            f"the record of torsion, hit at the left, also shows {others} Hz"
            if others
            else "the record of torsion, hit at the left, shows no other mode"
        )
    third = chosen["z_torsion"]
    if isinstance(third, Mode) and "z_torsion_Hz" not in spec.limits:
        notes.append(_THIRD_MODE.format(f_Hz=third.f_Hz, axial=FRAME_Hz[0], torsion=FRAME_Hz[1]))
    return notes + [
        f"{_FREE_FREE_WORDS[name]}: in the strut it lies at about {mode.f_Hz / math.sqrt(2):.3g} Hz, lower by a factor "
        f"of sqrt 2 (finite elements: {FREE_FREE_Hz[name]:g} Hz)"
        for name in FREE_FREE_Hz
        if isinstance(mode := chosen[name], Mode)
    ]


SETTINGS = (
    Setting("impacts_min", IMPACTS_MIN, "good impacts that a record needs; never fewer than three"),
    Setting("level_ratio", 3.0, "an impact this many times above or below the median is off level", positive=True),
    Setting("coherence_min", 0.9, "agreement of an impact's response with what the others predict"),
    Setting("force_range_N", 0.0, "range of the force sensor; 0: not stated, overloads show by their flat tops only"),
    Setting("double_hit_ms", 100.0, "a second peak within this many ms of a hit makes it a double hit", positive=True),
    Setting("double_hit_share", 0.03, "a second peak counts from this part of the first one", positive=True),
    Setting("ringing_samples", 5.0, "samples for which the analyser's filter rings after a hit", positive=True),
    Setting("torsion_contrast", 4.0, "how much weaker the top impact must show the torsion mode"),
    SAMPLING,
    Setting("lowest_Hz", 60.0, "modes are searched from here"),
    Setting("highest_Hz", 2000.0, "to here"),
)
PICTURE = """\
  side view           from above
      ┌───┐          ┌──────────┐
 hit ▶│top│◀ o       │ hit ● top│
  ┌───┴───┴───┐      │          │
  │    APA    │     ▶│ hit left │
  └───┬───┬───┘      └──────────┘
   ═══╧═══╧═══       o vibrometer
   10 single hits, no double hits"""

CHECK = Check(
    name="spurious_modes",
    title="Spurious modes: bending and torsion",
    short="Spurious modes",
    kinds=("apa",),
    forms=(
        Form(
            "records",
            tuple(
                Series(
                    key,
                    f"hammer and rotation, {called}",
                    CHANNELS,
                    optional=True,
                    step="Track1_X_Resolution",
                    called=called,
                )
                for key, called in (
                    ("x_bending", "x-bending"),
                    ("y_bending", "y-bending"),
                    ("torsion_left", "torsion, hit at the left"),
                    ("torsion_top", "torsion, hit at the top"),
                )
            ),
        ),
    ),
    quantities={
        "x_bending_Hz": "Bending in x",
        "x_bending_damping_percent": "Bending in x, damping",
        "y_bending_Hz": "Bending in y",
        "y_bending_damping_percent": "Bending in y, damping",
        "z_torsion_Hz": "Torsion about z",
        "z_torsion_damping_percent": "Torsion about z, damping",
        "x_bending_harmonic_3_Hz": "Bending in x, 3rd harmonic",
        "x_bending_harmonic_5_Hz": "Bending in x, 5th harmonic",
        "y_bending_harmonic_3_Hz": "Bending in y, 3rd harmonic",
    },
    measure=measure,
    settings=SETTINGS,
    stated=(
        "x_bending_Hz",
        "y_bending_Hz",
        "z_torsion_Hz",
        "x_bending_damping_percent",
        "y_bending_damping_percent",
        "z_torsion_damping_percent",
    ),
    failed="check the clamping of the part and repeat; if it stays, shell or joints are off",
    guide=Guide(
        "Hit with the hammer at the point in the drawing, about ten single hits per record; vibrometer opposite. "
        "Wait until the vibration has decayed before the next hit. A double hit does not count: hit again.",
        PICTURE,
        drive="none; you hit by hand",
    ),
)


def _panels(
    values: Values,
    tests: Mapping[str, HammerTest],
    modes: Mapping[str, tuple[Mode, ...]],
    band_Hz: tuple[float, float],
) -> dict[str, Panel]:
    """Return the panels "<record>_impacts" of every record that could be read, "<record>_frf" for those with an FRF."""
    out = {
        f"{key}_impacts": impacts_panel(_words(key), values[key].t, test.force, test.impacts)
        for key, test in tests.items()
    }
    for key, test in tests.items():
        if test.frf is not None:
            # The mode that only the left impact has is torsion, so the top one's FRF is drawn with it.
            top = tests["torsion_top"].frf if key == "torsion_left" and "torsion_top" in tests else None
            out[f"{key}_frf"] = frf_panel(key, test.frf, modes.get(key, ()), band_Hz, top)
    return out


def frf_panel(
    key: str, frf: ImpactFrf, modes: tuple[Mode, ...], band_Hz: tuple[float, float], beside: ImpactFrf | None = None
) -> Panel:
    """Return the magnitude of the averaged FRF with its 95 % band, the local fits and the modes."""
    s = (band_Hz[0] <= frf.f) & (frf.f <= band_Hz[1])
    magnitude, u = np.abs(frf.H[s]), np.sqrt(frf.var[s])
    items: list[Item] = [
        Band(frf.f[s], np.maximum(magnitude - 2 * u, 0.1 * magnitude), magnitude + 2 * u, "scatter between impacts"),
        Line(frf.f[s], magnitude, "measured", role="data"),
    ]
    if beside is not None:
        k = (band_Hz[0] <= beside.f) & (beside.f <= band_Hz[1])
        items.insert(1, Line(beside.f[k], np.abs(beside.H[k]), "top impact", role="before"))
    for n, m in enumerate(modes):
        items.append(Line(m.f, np.abs(m.fit), "" if n else "local fit", "dashed", "model"))
        items.append(Mark(m.f_Hz, label=f"{m.f_Hz:.4g} Hz", role="model"))
    return Panel(_words(key), "frequency [Hz]", "|rotation / force| [rad/N]", tuple(items), x_log=True, y_log=True)


def _words(key: str) -> str:
    return key.replace("_", " ")
