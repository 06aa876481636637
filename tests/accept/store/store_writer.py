"""A program that appends events and says so, for tests of many writers: `store_writer.py WHO COUNT`.

Each line on stdout is an acknowledged event: its number and its hash.
"""

import sys

from accept.store import open_store


def main(who: str, count: int) -> None:
    with open_store() as store:
        for i in range(count):
            event = store.append("unit_judged", f"{who}-{i}", {"i": i, "text": "x" * (37 * i % 5000)}, who=who)
            print(event.seq, event.hash, flush=True)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
