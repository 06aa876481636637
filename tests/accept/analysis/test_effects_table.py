"""The table of effects on the page of contracts is that of the library."""

from pathlib import Path

from accept.analysis.effects_table import HEAD, PAGE, table, update_table
from checks.gap import EFFECTS

ROOT = Path(__file__).parents[3]


def test_the_page_of_contracts_has_the_effects_that_there_are() -> None:
    """Renew it with: python -m accept.analysis.effects_table"""
    page = (ROOT / PAGE).read_text(encoding="utf-8")
    assert update_table(page) == page
    assert all(f"| `{name}` |" in page for name in EFFECTS)


def test_every_effect_says_what_it_does_to_the_model() -> None:
    assert not [name for name, effect in EFFECTS.items() if not effect.does]


def test_an_old_table_is_replaced_and_nothing_else() -> None:
    page = f"before\n\n{HEAD}| `gone` | | moved away |\n\nafter\n\n| another | table |\n"
    assert update_table(page) == f"before\n\n{table()}\nafter\n\n| another | table |\n"
