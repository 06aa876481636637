"""The acceptance checks: each file of this folder is the check of its name and holds its `CHECK`; code shared by
several checks is in the subfolders. Other packages add theirs under `accept.checks`.

    check = CHECKS.of_kind("capacitance", "apa")  # as units of that product are measured
    check.inputs, check.settings, check.quantities  # as declared (`checks.declare`)
    outcome = check.measure(values, spec.checks["capacitance"])  # values by input, or a NoResult with its cause
    [(q.name, q.value, q.U, q.unit) for q in outcome.quantities]

    CHECKS["frf"]  # any check by name; a check is loaded when it is first asked for
    record_faults(record), size_faults(record)  # why judging refuses a record"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from itertools import chain
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

from checks.cause import Cause, NoResult
from checks.declare import Check, Values
from checks.quantity import Outcome, Quantity
from specs import door, plugins
from specs.plugins import products
from specs.spec import CheckSpec
from specs.units import label_from_name

if TYPE_CHECKING:
    from checks.acceptance.common.typed_value import with_temperature
    from checks.acceptance.flatness import POSITIONS_MM, minimum_zone
    from checks.acceptance.responses.rules import record_faults, size_faults
    from checks.acceptance.spurious_modes import FRAME_Hz, hammer_progress
    from checks.acceptance.stiffness import deflection_of
    from checks.signals.impact.progress import HitsSoFar
else:
    __getattr__ = door(__name__)

RESERVED = (  # keys and sections of a unit.toml that are of the unit: all others are those of checks
    "serial", "kind", "parts", "channels", "measured", "notes", "experiments", "origin", "environment", "provided",
    "pictures", "simulated", "measured_by", "read_with",
)  # fmt: skip

OF_RESPONSES = ("frf", "misalignment", "sensor_highpass", "spurious_modes")  # they load transforms and models

_OWN = frozenset(module.name for module in iter_modules(__path__) if not module.ispkg)  # files of this folder


@dataclass(frozen=True)
class GuardedMeasurement:
    """The measurement of another package's check: its outcome is checked before it is judged."""

    check: Check

    def __call__(self, values: Values, spec: CheckSpec) -> Outcome:
        outcome, check = self.check.measure(values, spec), self.check
        sound = isinstance(outcome, Outcome) and all(isinstance(q, Quantity) for q in outcome.quantities)
        names = [q.name for q in outcome.quantities] if sound else []
        if sorted(names) != sorted(check.quantities):
            found = ", ".join(names) or repr(outcome)
            raise NoResult(Cause.PLUGIN_QUANTITIES, check=check.name, found=found, expected=", ".join(check.quantities))
        return outcome


class Checks(Mapping[str, Check]):
    """Checks by name. The program's own are loaded at their first use; their names are known before."""

    def __init__(self) -> None:
        self._loaded: dict[str, Check] = {}

    def __getitem__(self, name: str) -> Check:
        if name not in self._loaded:
            if name not in _OWN:
                raise KeyError(name)
            self._loaded[name] = import_module(f"checks.acceptance.{name}").CHECK
        return self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(_OWN | self._loaded.keys()))

    def __len__(self) -> int:
        return len(_OWN | self._loaded.keys())

    def __contains__(self, name: object) -> bool:
        return name in _OWN or name in self._loaded

    def is_own(self, name: object) -> bool:
        """Return whether the check is the program's own, and not another package's."""
        return name in _OWN

    @property
    def loaded(self) -> tuple[Check, ...]:
        """Return the checks that are loaded already, and those of other packages."""
        return tuple(self._loaded.values())

    def add(self, more: Mapping[str, Check]) -> None:
        """Add checks of other packages under names that are not taken."""
        self._loaded |= {name: replace(check, measure=GuardedMeasurement(check)) for name, check in more.items()}

    def remove(self, names: Iterable[str]) -> None:
        for name in set(names) - _OWN:
            self._loaded.pop(name, None)

    def of_kind(self, name: str, kind: str) -> Check:
        """Return a check for units of a product, without the channels that it does not have. Raises KeyError."""
        product = products().get(kind)
        return self[name].without(product.absent) if product is not None and product.absent else self[name]

    def label_of(self, quantity: str) -> str:
        """Return the label of a quantity, as its check declares it, else words made from its name.

        Loaded checks are searched first, so that judging by two checks loads no other; those of responses last."""
        quick_first = sorted(self, key=OF_RESPONSES.__contains__)
        for check in chain(self.loaded, map(self.__getitem__, quick_first)):
            if quantity in check.quantities:
                return check.labels[quantity]
        return label_from_name(quantity)

    def problem(self, check: Any) -> str:
        """Return the fault of a check of another package, "" without one."""
        if not isinstance(check, Check):
            return f"is a {type(check).__name__}, expected a Check"
        if not check.name.isidentifier() or check.name in RESERVED:
            return f"a check cannot be called '{check.name}'"
        if check.section is not None and check.section not in self:
            return f"check '{check.name}' reads section '{check.section}', which no check has"
        if not (check.quantities and check.kinds and (check.forms or check.section)):
            return f"check '{check.name}' declares no quantities, kinds or forms"
        owners = {q: own.name for own in self.values() for q in own.quantities}
        taken = [f"{q} (of {owners[q]})" for q in check.quantities if q in owners]
        return f"check '{check.name}' measures {', '.join(taken)}: one check per quantity" if taken else ""


CHECKS = Checks()


CHECKS.add(plugins.plugins(plugins.CHECKS, CHECKS.problem, CHECKS))
