"""Names beside disagreement: evidence with the size of what is left free, and the gates that a near miss does not pass.

Red on the search that compares explanations as if they explained everything: it names nothing in the first class, and a
member of the library that is only the nearest in the second.
"""

from dataclasses import replace

import numpy as np
import pytest

from checks.arrays import Complex
from checks.fitting import Dataset
from checks.gap.statistics.disagreement import VALUES_PER_CELL, cells, left_by_cell, with_disagreement
from checks.gap.workflow import Inputs, run
from tests.checks.gap.shared.gap_cases import CHANNELS, F, inputs


def quiet(words: str) -> None:
    del words


def times(given: Inputs, channel: str, factor: Complex) -> Inputs:
    """The same records with one channel multiplied by a factor (F,): what no effect of the library does."""
    by = np.ones((F.size, len(CHANNELS)), dtype=complex)
    by[:, CHANNELS.index(channel)] = factor
    A, B = (replace(d, H=d.H * by, cov=d.cov * by[:, :, None] * by[:, None, :].conj()) for d in (given.A, given.B))
    return replace(given, A=A, B=B)


def wavy() -> Complex:
    """A gain that goes up and down by a sixth, three times between 8 Hz and 2 kHz."""
    return np.asarray(1.0 + 0.17 * np.sin(2.0 * np.pi * 3.0 * np.log(F / F[0]) / np.log(F[-1] / F[0])), dtype=complex)


class TestSizes:
    """Closed form: what the weights and the cells are."""

    @staticmethod
    def flat(n: int = 64) -> Dataset:
        f = np.geomspace(5.0, 640.0, n)
        cov = np.full((n, 1, 1), 0.25, dtype=complex)
        return Dataset(f, np.ones((n, 1), dtype=complex), ("de",), cov, np.full(n, np.inf))

    def test_a_cell_is_half_an_octave(self) -> None:
        assert cells(np.array([5.0, 7.0, 7.2, 10.1])).tolist() == [0, 0, 1, 2]

    def test_left_is_the_mean_of_each_cell(self) -> None:
        data = self.flat()
        residual = np.where(data.f[:, None] < 10.0, 1.0 + 0j, 0.5)
        Q = left_by_cell(data, residual)
        assert Q[:2, 0] == pytest.approx([4.0, 4.0])  # |1|^2 / 0.25
        assert Q[2:, 0] == pytest.approx(np.ones(len(Q) - 2))

    def test_a_cell_says_two_numbers_however_many_bins_it_has(self) -> None:
        """Q far above 1: the residual's energy in the raised variance is that of two real numbers a cell."""
        for n in (64, 640):
            data = self.flat(n)
            residual = np.full((n, 1), 50.0 + 0j)
            raised = with_disagreement(data, residual)
            energy = 2.0 * np.abs(residual) ** 2 / raised.variance
            every = np.unique(cells(data.f)).size
            assert energy.sum() == pytest.approx(every * VALUES_PER_CELL, rel=1e-3)

    def test_where_nothing_is_left_nothing_is_raised(self) -> None:
        data = self.flat()
        assert np.array_equal(with_disagreement(data, np.full((64, 1), 0.4 + 0j)).cov, data.cov)


class TestNamedBeside:
    """An effect beside something that nothing explains, on another channel."""

    def test_name_value_and_rest(self) -> None:
        found = run(times(inputs(3, {"sensor_highpass": {"f_Hz": 12.0}}), "de", wavy()), quiet)
        assert found.verdict == "partly_explained"
        (named,) = found.named
        assert named.effect == "sensor_highpass"
        at = named.parameters["f_Hz"]
        assert at.lo < 12.0 < at.hi
        assert found.gap_after.channels["Vs"].G < 1.5 < found.gap_after.channels["de"].G
        assert {u.channel for u in found.unnamed} == {"de"}
        assert found.steps[-1].effect == "sensor_highpass"
        assert found.steps[-1].channels["Vs"] < 0.01 * found.steps[0].channels["Vs"]


class TestNotNamed:
    """The nearest member of a library is not the cause."""

    def test_a_mode_that_every_channel_sees_in_its_own_part_has_no_name(self) -> None:
        """A payload that tilts, a guide that gives way, a mass that hangs on the head: all are one more oscillator. Red
        before: a support, and beside a hanging mass a misalignment too."""
        given = inputs(
            3,
            {
                "support_mode": {
                    "f_Hz": 140.0,
                    "ratio_Vs": 0.03,
                    "ratio_de": -0.05,
                    "ratio_da": 0.1,
                    "damping_ratio": 0.01,
                }
            },
        )
        found = run(given, quiet)
        assert not found.named
        assert found.verdict == "unexplained"
        assert found.tried

    def test_a_mode_of_one_channel_is_no_support(self) -> None:
        """Red before: named, with a part of 5e-9 in de. On one channel alone it is any filter."""
        f0 = F / 300.0
        given = times(inputs(3), "Vs", np.asarray(1.0 + 0.3 / (1.0 - f0**2 + 0.02j * f0)))
        found = run(given, quiet)
        assert not found.named
        assert {u.channel for u in found.unnamed} == {"Vs"}

    def test_a_filter_of_fourth_order_is_no_delay(self) -> None:
        given = inputs(3, {"channel_lowpass_Vs": {"f_Hz": 2500.0, "order": 4.0}})
        known = frozenset({"channel_lowpass_Vs"})
        found = run(replace(given, without=known), quiet)
        assert "sample_offset" not in {n.effect for n in found.named}
        assert "channel_latency_Vs" not in {n.effect for n in found.named}

    def test_and_is_named_where_the_library_has_it(self) -> None:
        """Its phase looks like two whole samples before any fit, which the fit takes back."""
        found = run(inputs(3, {"channel_lowpass_Vs": {"f_Hz": 2500.0, "order": 4.0}}), quiet)
        assert [n.effect for n in found.named] == ["channel_lowpass_Vs"]
        assert found.gap_after.channels["Vs"].G < 1.5
