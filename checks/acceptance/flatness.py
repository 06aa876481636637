"""Flatness of the two interface planes from probe heights ([STB] 2.1)."""

import math
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array
from checks.cause import Cause, NoResult
from checks.declare import Check, CsvTable, Form, Guide, Setting, Values, Vector
from checks.picture import Band, Heights, Line, Panel
from checks.quantity import COVERAGE_FACTOR, Contribution, Outcome, Quantity
from specs.spec import CheckSpec, StatedU

USUAL_UM = (-200.0, 200.0)  # of a height over point 1: beyond it the probe slipped, or the unit is another
POSITIONS_MM = [[-29.5, 9], [-16, 9], [-16, -9], [-29.5, -9], [16, 9], [29.5, 9], [29.5, -9], [16, -9]]
MOST_SPREAD_UM = 2000.0  # 2 degrees over the part: no part lies so askew on the table
MIN_POINTS_PER_INTERFACE = 4  # three points always lie in a plane: they would show a flatness of zero
APART_MM = 0.1  # closer than a probe is placed: one position read twice
MM = 1e-3
UM = 1e-6


@dataclass(frozen=True, eq=False)
class Zone:
    """Minimum zone of points: two parallel planes z = slope . (x, y) + offset, at `half_width` to either side.

    slope (2,), offset and half_width in the units of the points; weights (N,): d(half_width)/dz, the multipliers of the
    linear programme, zero at every point that does not touch the zone."""

    half_width: float
    slope: Array
    offset: float
    weights: Array


def minimum_zone(x: Array, y: Array, z: Array) -> Zone:
    """Return the exact minimum zone of N points (N,): min h subject to |z - a x - b y - c| <= h, as a linear programme.

    The programme minimises the width along z; the zone stands normal to its plane, so the width is multiplied by the
    cosine of the tilt (1 - 5e-6 at 3 mrad, far below any probe). Source: [ISO12781-1] 3.3 (MZPL reference plane); the
    programme: Chebyshev approximation, [BV04] 6.1. Raises ValueError if the points do not span a plane."""
    scale = float(max(np.ptp(x), np.ptp(y), 1e-300))
    design = np.column_stack([(x - x.mean()) / scale, (y - y.mean()) / scale, np.ones_like(x)])
    if np.linalg.matrix_rank(design, tol=1e-6) < 3:
        raise ValueError("the points lie on one line: they span no plane")
    span = float(np.ptp(z)) or 1.0
    heights = (z - z.mean()) / span
    one = np.ones((z.size, 1))
    # linprog wants A v <= b with v = (a, b, c, h): residual <= h and -residual <= h.
    rows = np.vstack([np.hstack([-design, -one]), np.hstack([design, -one])])
    from scipy.optimize import linprog  # loads slowly: only when wanted

    found = linprog([0, 0, 0, 1], rows, np.concatenate([-heights, heights]), bounds=[(None, None)] * 3 + [(0, None)])
    if not found.success:
        raise ValueError(f"the minimum zone was not found: {found.message}")
    slope = found.x[:2] * span / scale
    offset = float(found.x[2] * span + z.mean() - slope @ [x.mean(), y.mean()])
    multipliers = -np.asarray(found.ineqlin.marginals)
    weights = multipliers[: z.size] - multipliers[z.size :]
    cosine = 1.0 / math.hypot(1.0, *slope)  # no square that overflows and makes every part flat
    return Zone(float(found.x[3] * span) * cosine, slope, offset, weights)


def least_squares_plane(x: Array, y: Array, z: Array) -> tuple[Array, Array]:
    """Return the slope (2,) of the least-squares plane and its cofactor (2, 2): its covariance per var(z)."""
    design = np.column_stack([x - x.mean(), y - y.mean()])
    cofactor = np.linalg.inv(design.T @ design)
    return cofactor @ design.T @ (z - z.mean()), cofactor


def measure(values: Values, spec: CheckSpec) -> Outcome:
    """Return half-width of the minimum zone, peak-to-valley by it and by least squares [um], and tilt."""
    x, y, z = _points(values, spec)
    reading = spec.uncertainty.get("z_um")
    left, right = x < 0, x > 0
    for name, side in (("x < 0", left), ("x > 0", right)):
        if side.sum() < MIN_POINTS_PER_INTERFACE:
            raise NoResult(Cause.POINTS_MISSING, points=int(side.sum()), side=name, needed=MIN_POINTS_PER_INTERFACE)
    _vet_points(x, y, z, reading)
    try:
        zone = minimum_zone(x, y, z)
        planes = [_plane_of(x[side], y[side], z[side]) for side in (left, right)]
    except ValueError as e:
        raise NoResult(Cause.POINTS_IN_LINE, detail=str(e)) from e
    residual = z - zone.slope[0] * x - zone.slope[1] * y - zone.offset
    quantities = (
        _weighted_heights("flatness_um", zone.half_width / UM, float(np.linalg.norm(zone.weights)), reading),
        _weighted_heights("flatness_pv_um", 2 * zone.half_width / UM, 2 * float(np.linalg.norm(zone.weights)), reading),
        _least_squares_peak_to_valley(x, y, z, reading),
        _tilt(planes, reading),
    )
    return Outcome(quantities, panels=_panels(x, y, residual, zone.half_width))


def _vet_points(x: Array, y: Array, z: Array, reading: StatedU | None) -> None:
    """Raise NoResult if a position occurs twice, or if the heights' spread is below the resolution of the probe or
    above `MOST_SPREAD_UM`: no part is so level or so tilted; they were not measured, or are not in um."""
    distance = np.hypot(x[:, None] - x, y[:, None] - y) + np.diag(np.full(x.size, np.inf))
    first, second = np.unravel_index(int(np.argmin(distance)), distance.shape)
    if distance[first, second] < APART_MM * MM:
        x_mm, y_mm = x[first] / MM, y[first] / MM
        raise NoResult(Cause.POINT_TWICE, first=int(first) + 1, second=int(second) + 1, x_mm=x_mm, y_mm=y_mm)
    floor = reading.U if reading is not None and reading.U is not None else 0.0
    if np.ptp(z) / UM <= floor:
        raise NoResult(Cause.HEIGHTS_ALIKE, span=np.ptp(z) / UM, floor=floor)
    if np.ptp(z) / UM > MOST_SPREAD_UM:
        raise NoResult(Cause.HEIGHTS_APART, span=np.ptp(z) / UM, most=MOST_SPREAD_UM)


def _points(values: Values, spec: CheckSpec) -> tuple[Array, Array, Array]:
    """Return (x, y, z) [m] from the table or from typed heights at the spec's positions."""
    if "points" in values:
        table = values["points"]
        return table["x_mm"] * MM, table["y_mm"] * MM, table["z_um"] * UM
    if "z_um" not in values:
        raise NoResult(Cause.NOT_MEASURED, record="z_um")
    positions = np.asarray(spec.settings.get("positions_mm", POSITIONS_MM), dtype=float)
    heights = np.asarray(values["z_um"], dtype=float)
    if positions.shape != (heights.size, 2):
        raise NoResult(Cause.HEIGHTS_COUNT, found=heights.size, expected=len(positions))
    return positions[:, 0] * MM, positions[:, 1] * MM, heights * UM


def _plane_of(x: Array, y: Array, z: Array) -> tuple[Array, Array]:
    if np.linalg.matrix_rank(np.column_stack([x - x.mean(), y - y.mean()]) / MM, tol=0.1) < 2:
        raise ValueError(f"the points of the interface at x = {x.mean() / MM:.1f} mm lie on one line")
    return least_squares_plane(x, y, z)


def _weighted_heights(name: str, value: float, sensitivity: float, reading: StatedU | None) -> Quantity:
    """Return a quantity that is a weighted sum of heights; `sensitivity`: root of the sum of squares of the weights."""
    if reading is None or reading.U is None:  # a percentage of a height has no meaning: heights have no natural zero
        return Quantity(name, value)
    return Quantity.of(name, value, Contribution(reading.source, sensitivity * reading.U / COVERAGE_FACTOR))


def _least_squares_peak_to_valley(x: Array, y: Array, z: Array, reading: StatedU | None) -> Quantity:
    slope, _ = least_squares_plane(x, y, z)
    residual = z - z.mean() - slope[0] * (x - x.mean()) - slope[1] * (y - y.mean())
    # The two extreme points carry the value; the plane's own share of the variance is left in: an upper bound.
    return _weighted_heights("flatness_ls_pv_um", float(np.ptp(residual)) / UM, math.sqrt(2.0), reading)


def _tilt(planes: list[tuple[Array, Array]], reading: StatedU | None) -> Quantity:
    """Return the angle between the least-squares planes of the two interfaces [urad], small angles."""
    (slope_1, cofactor_1), (slope_2, cofactor_2) = planes
    difference = slope_2 - slope_1
    tilt = math.hypot(*difference)
    direction = difference / tilt if tilt > 0 else np.array([1.0, 0.0])
    # heights in um over lengths in m give urad
    sensitivity = math.sqrt(float(direction @ (cofactor_1 + cofactor_2) @ direction))
    return _weighted_heights("interface_tilt_urad", tilt * 1e6, sensitivity, reading)


def _panels(x: Array, y: Array, residual: Array, half_width: float) -> dict[str, Panel]:
    number = np.arange(1, residual.size + 1, dtype=float)
    edge = np.array([0.5, residual.size + 0.5])
    zone = Band(edge, np.full(2, -half_width / UM), np.full(2, half_width / UM), "minimum zone")
    heights = Heights(x / MM, y / MM, residual / UM, "height above the fitted plane [um]")
    return {
        "heights": Panel("Interfaces seen from above", "x [mm]", "y [mm]", (heights,), equal=True),
        "zone": Panel(
            "Minimum zone",
            "point",
            "height above the plane [um]",
            (zone, Line(number, residual / UM, "probe", style="points", role="data")),
        ),
    }


PICTURE = """\
   y         seen from above
   │   ┌───────┐     ┌───────┐
 +9┤   │ 1   2 │     │ 5   6 │
   │   │       │ APA │       │
 -9┤   │ 4   3 │     │ 8   7 │
   │   └───────┘     └───────┘
   └────┬───┬─────────┬───┬─ x
      -29.5 -16 mm   16 29.5"""

CHECK = Check(
    name="flatness",
    title="Flatness of the two interface planes",
    short="Flatness",
    kinds=("apa",),
    forms=(
        Form("points", (CsvTable("points", "probe heights over the two interfaces", ("x_mm", "y_mm", "z_um")),)),
        Form(
            "heights",
            (
                Vector(
                    "z_um", "8 heights in the order of the picture", 8, item="height", usual=USUAL_UM, called="heights"
                ),
            ),
        ),
    ),
    quantities={
        "flatness_um": "Flatness, half of the zone",
        "flatness_pv_um": "Flatness, whole zone (ISO 12781)",
        "flatness_ls_pv_um": "Flatness, about the least-squares plane",
        "interface_tilt_urad": "Tilt between the interfaces",
    },
    measure=measure,
    settings=(Setting("positions_mm", POSITIONS_MM, "x, y of the 8 probe points in the order of reading"),),
    stated=("z_um",),
    failed="clean both faces and the table and measure again; if it stays, the part is bent",
    guide=Guide(
        "Place the part on the table. Set the probe to zero at point 1, then measure points 1 to 8 in this order. "
        "Read each height when the probe has settled. You can load a table of points instead.",
        PICTURE,
        drive="none; the amplifier is off",
    ),
)
