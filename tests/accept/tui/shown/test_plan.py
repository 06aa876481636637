"""The plan of the probe's points while they are taken: heights at their places, the next point marked."""

from accept.tui.widgets.pictures import Pictures
from accept.tui.widgets.plot import PanelPlot
from tests.accept.tui.tui_help import HEIGHTS, begin, press, running, type_line


def drawn(pilot) -> str:
    return "\n".join(str(plot.render()) for plot in pilot.app.screen.query(PanelPlot))


async def test_the_next_point_is_marked_and_heights_stand_at_their_places_as_they_are_taken() -> None:
    """Red before: the plan was empty until the last height was there."""
    heights = HEIGHTS.split()
    async with running(size=(120, 36)) as pilot:
        await begin(pilot)
        await press(pilot, "enter")
        assert "1 ◉" in drawn(pilot)
        for n, height in enumerate(heights[:3], 2):
            await type_line(pilot, height)
            assert f"{n} ◉" in drawn(pilot)
            assert f"{float(height):+.1f}" in drawn(pilot)
        views = list(pilot.app.screen.query(PanelPlot))
        for height in heights[3:]:
            await type_line(pilot, height)
        assert "◉" not in drawn(pilot)
        assert list(pilot.app.screen.query_one(Pictures).panels) == ["heights", "zone"]  # those of the judgement
        assert list(pilot.app.screen.query(PanelPlot))[: len(views)] == views  # drawn in the same place


async def test_on_a_small_terminal_the_plan_is_behind_its_key() -> None:
    async with running() as pilot:
        await begin(pilot)
        await press(pilot, "enter")
        await type_line(pilot, HEIGHTS.split()[0])
        await press(pilot, "f7")
        assert "2 ◉" in drawn(pilot)
