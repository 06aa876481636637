"""What the technician is told at each step: two sentences and a drawing. A check without an entry here is told by its
own declaration."""

from dataclasses import dataclass

from checks.declare import Check, CsvTable, Form, Series


@dataclass(frozen=True)
class Guide:
    """words: two sentences. picture: lines of a drawing, at most 33 columns wide; "" for none."""

    words: str
    picture: str = ""


_FLATNESS = """\
   y          seen from above
   │   ┌───────┐       ┌───────┐
 +9┤   │ 1   2 │       │ 5   6 │
   │   │       │  APA  │       │
 -9┤   │ 4   3 │       │ 8   7 │
   │   └───────┘       └───────┘
   └────┬───┬───────────┬───┬── x
      -29.5 -16 mm     16 29.5"""

_CAPACITANCE = """\
   LCR meter, 1 kHz
    H ──┬────────┐
        │  ┌─────┴─────┐
    L ─┐│  │ 1 sensor  │
       ││  ├───────────┤
       │└──┤ 2 ┐ drive │ 2 and 3 in
       └───┤ 3 ┘       │ parallel
           └───────────┘
   first 1 alone, then 2 with 3"""

_STROKE = """\
      ▼ gauge
   ┌──┴──┐    record 1   record 2
   │ top │    1 ─ amp    1 ─ short
 ┌─┴─────┴─┐  2 ─ short  2 ┐ amp
 │ 1  2  3 │  3 ─ short  3 ┘
 └─┬─────┬─┘
   └─────┘      -20 V ... 150 V"""

_STIFFNESS = """\
      6.4 kg  ┌───┐  on at 15 s
              │ m │  off at 22 s
            ┌─┴───┴─┐
            │payload│
            └─┬───┬─┘
   encoder ─▶ │APA│
            ──┴───┴──  granite"""

_HYSTERESIS = """\
  Va      ╱╲        ╱╲
     ╱╲  ╱  ╲  ╱╲  ╱  ╲
  ──╱──╲╱────╲╱──╲╱────╲── t
   slow sines, growing amplitude
   record t, Va, de (and Vs)"""

_HIGHPASS = """\
   sensor stack
     ├───┬──────── ADC (Vs)
    ═╪═ ┌┴┐
     │  │R│ 80.6 kOhm
     │  └┬┘ 1 with R
     └───┴── 0 V   2 without"""

_SPURIOUS = """\
  side view           from above
      ┌───┐          ┌──────────┐
 hit ▶│top│◀ o       │  hit ● top
  ┌───┴───┴───┐      │          │
  │    APA    │   ▶ hit left    │
  └───┬───┬───┘      └──────────┘
   ═══╧═══╧═══       o vibrometer
   10 single hits, no double hits"""

_FRF = """\
        da interferometer
             ▼
         ┌───────┐ payload
         └─┬───┬─┘
     de ─▶ │   │ ── Vs sensor stack
   encoder │   │ ◀─ Va x 20 drive
         ──┴───┴──
    low record    | high record
    ... 350 Hz    | 350 Hz ..."""

GUIDES = {
    "flatness": Guide(
        "Set the part on the table and touch the 8 points in the order of the numbers, zero at point 1. "
        "Take each height when the probe has settled; a table of points can be given instead.",
        _FLATNESS,
    ),
    "capacitance": Guide(
        "Short the stacks for a moment, set the LCR meter to 1 kHz and measure the sensor stack alone. "
        "Then measure the two actuator stacks in parallel.",
        _CAPACITANCE,
    ),
    "stroke": Guide(
        "Drive one stack from -20 V to 150 V and back while the gauge reads the top, then the two others. "
        "Give both records, or the stroke of all three as one number.",
        _STROKE,
    ),
    "stiffness": Guide(
        "Record the encoder while the mass is set on at about 15 s and taken off at about 22 s, amplifier connected. "
        "Repeat with open stacks, and weigh the mass.",
        _STIFFNESS,
    ),
    "hysteresis": Guide(
        "Drive with slow sines of growing amplitude and record voltage and encoder. "
        "Leave the bench alone while it runs.",
        _HYSTERESIS,
    ),
    "sensor_highpass": Guide(
        "Record the slow sweep with the resistor across the sensor stack, then without it. "
        "Read the resistor's value from its label or a meter.",
        _HIGHPASS,
    ),
    "spurious_modes": Guide(
        "Hit with the hammer where the drawing shows, about ten single hits a record, vibrometer on the other side. "
        "Let it ring out between hits; a double hit must be repeated.",
        _SPURIOUS,
    ),
    "misalignment": Guide(
        "Nothing is measured here: the ratio of encoder to interferometer in the records of the frequency responses is "
        "held against a model, which takes some seconds. It tells how far the APA sits beside the joints' axis.",
    ),
    "frf": Guide(
        "Fix the payload, then record the low excitation up to 350 Hz and the high one above it. "
        "Keep hands off the bench, and give a second realisation where there is one.",
        _FRF,
    ),
}


def guide_of(check: Check) -> Guide:
    """The guide of a check, made of its declaration where nobody wrote one."""
    return GUIDES.get(check.name) or Guide(f"{check.title}. Give {_ways(check)}.")


def _ways(check: Check) -> str:
    return ", or ".join(_needs(form) for form in check.forms)


def _needs(form: Form) -> str:
    words = [f"the file '{i.label}'" if isinstance(i, Series | CsvTable) else i.label for i in form.inputs]
    return " and ".join(words)
