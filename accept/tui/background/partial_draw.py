"""Drawing what changed on a screen, and nothing else."""

from collections.abc import Iterable

from textual._compositor import Compositor, CompositorMap
from textual.geometry import Region
from textual.strip import Strip
from textual.widget import Widget


class PartialDraw(Compositor):
    """Takes of each part the rows that are drawn anew. The library's own takes all rows of all parts, which costs more
    than what changed where a value moves ten times a second."""

    def _get_renders(self, crop: Region | None = None) -> Iterable[tuple[Region, Region, list[Strip]]]:
        for widget, (region, clip) in self.visible_widgets.items():
            seen = region.intersection(clip)
            if crop is not None:
                rows = Region(seen.x, crop.y, seen.width if seen.overlaps(crop) else 0, crop.height)
                seen = seen.intersection(rows)
            if seen:
                yield seen, clip, widget.render_lines(seen.translate(-region.offset))

    @property
    def full_map(self) -> CompositorMap:
        """Return the place of each part, and have what moved since it was drawn drawn anew. The library compares places
        when it lays out the screen: what has moved by then, because a place was asked for, stays where it was drawn."""
        drawn = self._full_map if self._visible_map is None else self._visible_map
        found = super().full_map
        if found is not drawn and self._visible_map is None:
            self._dirty_regions.update(region for _, region in _seen(found) ^ _seen(drawn))
        return found


def _seen(places: CompositorMap) -> set[tuple[Widget, Region]]:
    """Return where something of a part is to be seen."""
    seen = {(widget, place.clip.intersection(place.region)) for widget, place in places.items()}
    return {(widget, region) for widget, region in seen if region}
