"""The sketch of the strut: a ring where the cause sits, a full one if nothing else explains the records as well."""

from typing import Any

import numpy as np
import pytest

from accept.gap.sketch import _OF_EFFECT, PLACES, place_panel
from checks.gap import EFFECTS
from checks.gap.decision.elements import PLACE_OF
from checks.picture import Line
from tests.accept.gap.test_gap_elements import ANSWER
from tests.checks.gap.shared.explained import FOUND

ELECTRONICS = {"amplifier", "channel", "loop", "crosstalk"}  # first words of effects that have no place in the strut


def rings(document: dict[str, Any], **more: bool) -> list[tuple[float, float, str, str]]:
    """Return middle, role and words of every outer ring."""
    panel = place_panel(document, **more)
    found = [item for item in panel.items if isinstance(item, Line) and item.role != "quiet"]
    found = [item for item in found if np.ptp(item.x) > 9.0]
    return [(round(float((i.x.max() + i.x.min()) / 2), 1), round(float(i.y.mean()), 0), i.role, i.label) for i in found]


def test_what_alone_fits_is_marked_at_its_places_as_sure() -> None:
    (x, z, role, words), below = [(a, round(b / 15.0), c, d) for a, b, c, d in rings(FOUND)]
    assert (x, z, role, words) == (0.0, 1, "bad", "misalignment: the only cause that fits")
    assert below[1] == -1


def test_places_that_explain_as_well_are_all_marked_and_counted() -> None:
    top, payload = rings({"elements": [ANSWER]})
    assert top[0] == -5.9  # beside the axis, as estimated
    assert payload[0] == 0.0
    assert {top[2], payload[2]} == {"model"}
    assert top[3] == "resonator: one of 2 places"


def test_rival_causes_are_marked_as_possible() -> None:
    found = rings({"ambiguous": [{"effects": ["sensor_highpass", "payload_mass"]}]})
    assert [(x, words) for x, _, _, words in found] == [
        (-22.5, "sensor highpass: one of 2 causes"),
        (0.0, "payload mass: one of 2 causes"),
    ]


@pytest.mark.parametrize(
    "document", [{}, {"named": [{"effect": "loop_delay"}]}, {"named": [{"effect": "of_a_plug_in"}]}]
)
def test_what_has_no_place_is_not_drawn(document: dict[str, Any]) -> None:
    assert place_panel(document) is None


def test_an_apa_alone_has_no_joints() -> None:
    both = [len(place_panel(FOUND, of_strut=of_strut).items) for of_strut in (True, False)]
    assert both[0] - both[1] == 8  # four sides of joints, payload, base, head and ruler


def test_every_part_of_an_element_and_every_effect_of_the_mechanics_has_a_place() -> None:
    assert {part.lower() for part, _ in PLACE_OF} <= PLACES.keys()
    assert {effect for effect in EFFECTS if effect.partition("_")[0] not in ELECTRONICS} == _OF_EFFECT.keys()
