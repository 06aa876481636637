"""The few colours of the house (Okabe and Ito, 2008: safe for colour-blind eyes), also distinct in grey."""

from collections.abc import Iterable

from checks.picture import Item, Mark, Span

NAVY, BLUE, SKY = "#14213d", "#0072b2", "#56b4e9"
VERMILION, GREEN, ORANGE = "#d55e00", "#009e73", "#e69f00"
INK, GREY, PALE, GRID = "#222222", "#777777", "#c8ccd0", "#e4e6e8"

ROLES = {
    "data": BLUE,
    "model": VERMILION,
    "before": "#999999",
    "good": GREEN,
    "bad": VERMILION,
    "limit": "#444444",
    "quiet": PALE,
}
# Dark to light and back, so that neighbours differ in grey too.
SERIES = (NAVY, VERMILION, SKY, GREEN, ORANGE, BLUE)


def colour(role: str, nth: int) -> str:
    """Return colour of a role; "auto" takes the nth of the series."""
    return SERIES[nth % len(SERIES)] if role == "auto" else ROLES[role]


def tinted(items: Iterable[Item]) -> list[tuple[Item, str, bool]]:
    """Return items, zones and marks last, each with its colour and whether a curve of it is dashed: those without a
    role take the next of the series, of which colours this far on are too close in grey."""
    found, nth = [], 0
    for item in sorted(items, key=lambda i: isinstance(i, Span | Mark)):
        role = getattr(item, "role", "data")
        found.append((item, colour(role, nth), role == "auto" and nth >= 3))
        nth += role == "auto"
    return found


# cividis, dark to light and monotone in lightness ([NUNEZ18]), at equal steps; in between by straight lines.
MAP_STEPS = (
    "#00224e", "#002e6a", "#1a386f", "#32436d", "#434e6c", "#535a6d", "#61656f", "#6f7073", "#7d7c78", "#8c8878",
    "#9b9476", "#aba072", "#bcae6c", "#cdbb63", "#dec958", "#f0d846", "#fee838",
)  # fmt: skip
