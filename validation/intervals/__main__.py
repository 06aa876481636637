"""Print the table of coverage."""

import argparse

from validation.intervals.coverage import SECTIONS, SEED, scores, table


def main() -> None:
    """Print a row for each quantity of each section."""
    parser = argparse.ArgumentParser(description="coverage of the stated intervals")
    parser.add_argument("--repeats", type=int, default=200)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--section", choices=sorted(SECTIONS))
    wanted = parser.parse_args()
    print("| measurement | quantity | covered | U, median | mean error | |\n|---|---|---|---|---|---|")
    for section in [wanted.section] if wanted.section else SECTIONS:
        for row in table(section, scores(section, wanted.repeats, wanted.seed)):
            print(row, flush=True)


if __name__ == "__main__":
    main()
