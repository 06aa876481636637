"""Parameters of effects by the labels that their effects declare."""

import pytest

from accept.gap.text import HEADLINE, symbol, unit, value_words
from checks.gap import EFFECTS, GapVerdict
from specs.units import unit_of


@pytest.mark.parametrize(
    ("effect", "parameter", "words"),
    [
        ("misalignment", "dx_um", "dx 53.5 um"),
        ("payload_mass", "kg", "mass 53.5 kg"),
        ("crosstalk", "V_per_V", "coupling 53.5 V/V"),
        ("bench_mode", "damping_ratio", "damping ratio 53.5"),
        ("of another bench", "c_N_s_per_m", "c 53.5 N s/m"),
    ],
)
def test_a_value_is_called_as_its_effect_declares_it(effect: str, parameter: str, words: str) -> None:
    assert value_words(effect, parameter, 53.5) == words


def test_no_parameter_is_called_by_its_unit() -> None:
    """A name that is a unit alone, as `kg`, would print "kg = 0.5 kg"."""
    for effect in EFFECTS.values():
        for p in effect.parameters:
            assert symbol(effect.name, p.name) != p.name or unit_of(p.name) == "1", f"{effect.name}: {p.name}"
            assert unit(effect.name, p.name) == p.unit


def test_only_a_cause_that_was_found_is_called_one() -> None:
    """Each verdict has a headline of its own, by which a reader on the first line goes."""
    assert len({*HEADLINE.values()}) == len(HEADLINE) == len(GapVerdict)
    assert [verdict for verdict, words in HEADLINE.items() if "found" in words] == [GapVerdict.EXPLAINED]
