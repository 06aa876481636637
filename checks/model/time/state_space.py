"""The linear path from Va at the DAC to the channels as a state space, from its partial fractions."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.model.channel_paths import LATENCIES
from checks.model.electrical import electrical_of
from checks.model.model import Model
from checks.model.time.partial_fractions import STILL, paths


@dataclass(frozen=True, eq=False)
class StateSpace:
    """x' = A x + B u, y = C x + D u, each output delayed by delay_s (p,) [s], which is in no matrix.

    A (n, n), B (n, 1), C (p, n), D (p, 1): real; per volt at the DAC. states, outputs, input: names; units: of the
    outputs and the input."""

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    outputs: tuple[str, ...]
    input: str
    units: Mapping[str, str]
    delay_s: Array
    name: str

    @classmethod
    def of(cls, model: Model) -> "StateSpace":
        """Return the state space of a model without its learned bench. Raises ModelError without partial fractions."""
        found, values = paths(model), model.values
        poles = np.unique(np.concatenate([each.poles for each in found.values()]))
        residues = np.zeros((len(found), poles.size), complex)
        direct = np.zeros(len(found))
        for c, each in enumerate(found.values()):
            np.add.at(residues[c], np.searchsorted(poles, each.poles), each.residues)
            direct[c] = each.direct
        share = np.abs(residues / poles)
        kept = (share > STILL * share.max(axis=1, keepdims=True)).any(axis=0)
        poles, residues = poles[kept], residues[:, kept]
        A, B, C = _real(poles, residues)
        tau = electrical_of(values).tau
        latency = np.array([1e-6 * values.get(LATENCIES[c], 0.0) for c in found])
        return cls(
            A,
            B,
            C,
            direct[:, None],
            tuple(f"x{i + 1}" for i in range(len(A))),
            tuple(found),
            "Va",
            {"Va": "V", "Vs": "V", "de": "m", "da": "m"},
            tau + latency,
            model.name,
        )

    def frf(self, f: Array) -> Complex:
        """Return the response (F, p) at f (F,) [Hz], with the delays."""
        s = 2j * np.pi * np.asarray(f, float)
        x = np.linalg.solve(s[:, None, None] * np.eye(len(self.A)) - self.A, self.B.astype(complex)[None])
        return np.asarray((self.C @ x + self.D)[:, :, 0] * np.exp(-s[:, None] * self.delay_s))

    def __repr__(self) -> str:
        late = ", ".join(f"{c} {1e6 * d:.4g}" for c, d in zip(self.outputs, self.delay_s, strict=True))
        delays = f"; delays [us]: {late}" if self.delay_s.any() else ""
        return f"StateSpace({self.name}: {len(self.A)} states, {self.input} -> {', '.join(self.outputs)}{delays})"


def _real(poles: Complex, residues: Complex) -> tuple[Array, Array, Array]:
    """Return real A, B, C of y = sum of Re(residue x), x' = pole x + u: one state for a real pole, two for a pair.

    States are scaled so that A and B are in rad/s: x' = pole x + |pole| u, balanced enough for any tool."""
    widths = np.where(poles.imag == 0.0, 1, 2)
    n = int(widths.sum())
    A, B, C = np.zeros((n, n)), np.zeros((n, 1)), np.zeros((len(residues), n))
    at = 0
    for k, p in enumerate(poles):
        size = abs(p)
        B[at, 0], C[:, at] = size, residues[:, k].real / size
        A[at, at] = p.real
        if widths[k] == 2:
            A[at : at + 2, at : at + 2] = [[p.real, -p.imag], [p.imag, p.real]]
            C[:, at + 1] = -residues[:, k].imag / size
        at += int(widths[k])
    return A, B, C
