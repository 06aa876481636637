"""Geometry and materials of the frame APA in SI units, as a drawing would state them."""

import math
from dataclasses import dataclass, fields
from itertools import pairwise

from checks.errors import ModelError
from checks.model.structure.beam import Material

STEEL = Material(E=200e9, nu=0.3, rho=7850.0)
CERAMIC = Material(E=45.78e9, nu=0.3, rho=7850.0)  # soft PZT along its layers; E calibrated, see FrameGeometry


@dataclass(frozen=True)
class SolidBlock:
    """A solid block of the shell between an interface node and the two arms that it holds.

    box : sides of its steel along x, y, z [m], which set mass and inertia; half of the mass moves with the interface
    node, half with the arms. center : from the interface node to the box's center [m], towards the arms. neck : width
    along y and height across it [m] of the elastic steel between interface node and arms."""

    box: tuple[float, float, float]
    center: float
    neck: tuple[float, float]


@dataclass(frozen=True)
class FrameGeometry:
    """An elliptical shell of four arms around a row sensor stack, spacer, two actuator stacks.

    Interface: bottom and top at z = -+height/2, and `stations`, the ends of the stacks along x.
    The arms lie in the plane y = 0. An arm runs from the end block, at (+-(row's end + arm_beyond), +-arm_root_z), to
    the middle of the top or bottom block, at (0, +-arm_foot_z), bowed outwards by arm_rise at its middle.

    Dimensions are round where the maker's outline (about 78 x 20 x 30 mm) or the stacks' faces (10 x 10 mm, as the
    published matrices' mass and stiffness of a stack imply) fix them. Fourteen others are EFFECTIVE: calibrated by
    `frame_identify.identify` on the published finite-element matrices of the APA300ML (T. Dehaeze, stewart-simscape,
    MIT licence), not measured on a part. They are E of the ceramic, arm_root_z, arm_foot_z, arm_thickness (2),
    arm_width, arm_rise, the end block's box (3) and neck (2), the top box's side along z and the height of its neck.
    They stand for what beams leave out: fillets, the shell's curvature, local compliance under the stacks' faces. The
    boxes are the least determined, as only their mass and inertia show: do not take them for a drawing."""

    height: float = 30e-3
    stations: tuple[float, float, float, float, float] = (-32.5e-3, -12.5e-3, -7.5e-3, 12.5e-3, 32.5e-3)
    stack_side: float = 10e-3  # square face
    spacer_side: float = 10.4e-3  # of the part that carries load: a face a little wider than the stacks' footprint
    spacer_box: float = 14e-3  # outline along y and z, which sets its mass
    arm_beyond: float = 6.5e-3
    arm_root_z: float = 5.658e-3
    arm_foot_z: float = 12.722e-3
    arm_thickness: tuple[float, float] = (1.671e-3, 1.66e-3)  # at the root and at the foot, linear between
    arm_width: float = 19.57e-3  # along y
    arm_rise: float = 0.88e-3
    end: SolidBlock = SolidBlock(box=(24.4e-3, 8.68e-3, 4.49e-3), center=6.0e-3, neck=(5.79e-3, 10.85e-3))
    top: SolidBlock = SolidBlock(box=(20e-3, 24e-3, 0.719e-3), center=2.0e-3, neck=(16e-3, 5.044e-3))
    steel: Material = STEEL
    ceramic: Material = CERAMIC

    def __post_init__(self) -> None:
        """Raise ModelError naming the dimension that no part can have."""
        for name in (f.name for f in fields(self) if f.name not in ("stations", "arm_rise")):
            for value in _sizes(getattr(self, name)):
                if not (math.isfinite(value) and value > 0):
                    raise ModelError(f"frame APA: {name} holds {value}, expected a positive number")
        if not all(a < b for a, b in pairwise(self.stations)):
            raise ModelError(f"frame APA: stations {self.stations} m do not rise along x")
        if not self.arm_foot_z < self.height / 2:
            raise ModelError(
                f"frame APA: arm_foot_z {self.arm_foot_z} m is not inside half the height {self.height / 2} m"
            )
        for name, value in (
            ("arm_rise", self.arm_rise),
            ("end.center", self.end.center),
            ("top.center", self.top.center),
            *((f"stations[{i}]", x) for i, x in enumerate(self.stations)),
        ):
            if not math.isfinite(value):
                raise ModelError(f"frame APA: {name} is {value}, expected a number")


def _sizes(part: float | tuple[float, ...] | SolidBlock | Material) -> tuple[float, ...]:
    match part:
        case SolidBlock():
            return (*part.box, *part.neck)
        case Material():
            return (part.E, part.G, part.rho)
        case tuple():
            return part
        case _:
            return (part,)
