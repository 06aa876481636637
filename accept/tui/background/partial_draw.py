"""Drawing what changed on a screen, and nothing else."""

from collections.abc import Iterable

from textual._compositor import Compositor
from textual.geometry import Region
from textual.strip import Strip


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
