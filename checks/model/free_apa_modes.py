"""The free elastic modes of an APA as uncertain parameters: the deviation of a built APA from its matrices. A glue
joint, a fillet, a batch of ceramic change the frequencies and damping of a shell's modes. So every elastic mode k of
the free APA has a factor on its stiffness, `apa.mode_stiffness_k`, and one on its damping, `apa.mode_damping_k`. All
modes that the matrices hold, not only those within the band: below its first resonance the APA answers through the
compliance of all of them, and the signs of a misalignment depend on how these compliances cancel ([MARES06])."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy import linalg

from checks.model.dynamics.derivatives import Modes
from checks.model.parameters import MODE_DAMPING, MODE_STIFFNESS
from checks.model.structure.apa import ELASTIC_FROM, ApaBody
from checks.model.structure.matrix_builder import System


@lru_cache(maxsize=16)
def mode_names(modes: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the flat names of the factors on stiffness and on damping, by rising frequency of the nominal modes."""
    stiffness, damping = (tuple(f"{of}{k + 1}" for k in range(modes)) for of in (MODE_STIFFNESS, MODE_DAMPING))
    return stiffness, damping


@dataclass(frozen=True, eq=False)
class ModalApa:
    """values -> body in the coordinates of its free modes: six rigid ones, then the elastic ones (m,), each with unit
    modal mass, its stiffness and damping times its factors. A class, not a closure, so that a model can be pickled."""

    body: ApaBody

    @property
    def modes(self) -> int:
        return self.body.size - ELASTIC_FROM

    @property
    def frequencies_Hz(self) -> dict[str, float]:
        """Return the nominal frequency [Hz] of each factor's mode, by the factor's flat name."""
        f = np.sqrt(np.diag(self.body.K)[ELASTIC_FROM:]) / (2.0 * np.pi)
        return {name: float(f_Hz) for names in mode_names(self.modes) for name, f_Hz in zip(names, f, strict=True)}

    def below(self, f_Hz: float) -> int:
        """Return the elastic modes below a frequency."""
        return int(np.sum(np.diag(self.body.K)[ELASTIC_FROM:] < (2.0 * np.pi * f_Hz) ** 2))

    def __call__(self, values: Mapping[str, float]) -> ApaBody:
        stiffness, damping = (np.array([values[n] for n in names]) for names in mode_names(self.modes))
        rigid = np.ones(ELASTIC_FROM)
        w2, rate = np.diag(self.body.K), np.diag(self.body.C_ratio)
        return replace(
            self.body,
            K=np.diag(w2 * np.concatenate([rigid, stiffness])),
            C_ratio=np.diag(rate * np.concatenate([rigid, damping])),
        )

    def changes(self, damping_ratio: float, system: System) -> Modes:
        """Return the changes by the factors in a system whose first coordinates are the body's, or read as such."""
        size = self.body.size
        rows = np.eye(size, len(system.K)) if system.coordinates is None else system.coordinates[:size]
        elastic = slice(ELASTIC_FROM, None)
        w2, rate = np.diag(self.body.K)[elastic], np.diag(self.body.C_ratio)[elastic]
        return Modes(rows[elastic], w2, damping_ratio * rate)


def modal_apa(body: ApaBody) -> ModalApa:
    """Return an APA in the coordinates of its free modes. Raises LinAlgError for one without mass."""
    w2, shapes = linalg.eigh(body.K, body.M)
    ring = np.concatenate([np.zeros(ELASTIC_FROM), np.sqrt(w2[ELASTIC_FROM:])])
    return ModalApa(
        replace(
            body,
            K=np.diag(w2),
            M=np.eye(w2.size),
            C_ratio=np.diag(2.0 * ring),
            C=shapes.T @ body.C @ shapes,
            bottom=body.bottom @ shapes,
            top=body.top @ shapes,
            sensor=body.sensor @ shapes,
            actuator=body.actuator @ shapes,
            modal=not body.C.any(),
        )
    )
