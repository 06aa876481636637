"""Control charts against textbook data, closed forms and run lengths."""

import numpy as np
import pytest

from checks.process_control.control_chart import LEAST, RULES, chart, nelson


def test_limits_are_those_of_the_textbook():
    """Loan processing costs of 20 weeks ([Montgomery] example 6.5): mean 300.5,
    mean moving range 7.79, limits 279.78 and 321.22 (the book rounds)."""
    costs = [310, 288, 297, 298, 307, 303, 294, 297, 308, 306, 294, 299, 297, 299, 314, 295, 293, 306, 301, 304]
    made = chart(np.array(costs, dtype=float))
    assert made.mean == pytest.approx(300.5)
    assert made.moving_range.mean() == pytest.approx(7.79, abs=0.005)
    assert (made.lower, made.upper) == (pytest.approx(279.78, abs=0.02), pytest.approx(321.22, abs=0.02))
    assert made.range_limit == pytest.approx(25.45, abs=0.02)
    assert not made.alarms


PATTERNS = {
    1: [0.1, -0.2, 3.1],
    2: [0.3] * 9,
    3: [-0.6, -0.3, 0.1, 0.4, 0.8, 1.2],
    4: [0.5, -0.5] * 7,
    5: [2.1, 0.3, 2.2],
    6: [1.1, 1.2, 0.2, 1.3, 1.1],
    7: [0.2, -0.3] * 7 + [0.4],
    8: [1.2, -1.1] * 4,
}


@pytest.mark.parametrize("rule", RULES)
def test_each_rule_rings_at_the_value_that_completes_it(rule):
    z = np.array(PATTERNS[rule])
    assert z.size - 1 in nelson(z)[rule]
    if rule not in (1, 5, 6):  # these need fewer values than their window holds
        assert rule not in nelson(z[1:])
    assert rule not in nelson(z[:-1])


def test_a_process_in_control_rarely_rings_and_a_shift_is_seen():
    """Rule 1: 0.27 % of normal values, binomial band of 20,000. EWMA: a shift of one sigma is seen after about ten
    values on average ([Montgomery] table 9.11), so after thirty it is unseen in about (1 - 1/9)^27 = 4 %; the 99.9 %
    band of 100 such shifts reaches to 11."""
    rng = np.random.default_rng(5)
    z = rng.standard_normal(20_000)
    assert 30 < nelson(z)[1].size < 80  # 54 expected, sd 7.3
    late = 0
    for _ in range(100):
        made = chart(np.concatenate([rng.standard_normal(200), 1.0 + rng.standard_normal(30)]))
        late += not (made.ewma_alarms >= 200).any()
    assert late <= 11


def test_false_alarms_of_the_weighted_mean_are_as_rare_as_stated():
    """Run length 500: the mean of 60 runs until their first alarm; limits that are wrong by 5 % halve or double it."""
    rng = np.random.default_rng(6)
    first = [chart(rng.standard_normal(3000)).ewma_alarms for _ in range(60)]
    lengths = [a[0] if a.size else 3000 for a in first]
    assert 350 < np.mean(lengths) < 700  # exponential with mean 500: its mean over 60 has an sd of 65; cut at 3000


@pytest.mark.parametrize("values", [np.ones(LEAST - 1), np.array([1.0] * 9 + [np.nan]), np.ones((4, 4))])
def test_too_few_or_missing_values_are_refused(values):
    with pytest.raises(ValueError, match="expected"):
        chart(values)


def test_values_that_never_change_ring_nothing():
    assert chart(np.full(20, 3.0)).alarms == {} or 7 in chart(np.full(20, 3.0)).alarms
