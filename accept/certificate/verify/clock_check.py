"""What the order of events shows of a clock that was set back: what had run out by the latest time before an event."""

from collections.abc import Iterable, Iterator, Mapping
from datetime import datetime
from typing import Any

from accept.certificate.contents.outcome import Step
from accept.certificate.trust.revocation import CLOCK_SLACK
from accept.certificate.verify.signatures import Signed


def too_late(
    what: str, when: datetime, before: Iterable[str], ends: Mapping[str, str], now: datetime
) -> Iterator[Step]:
    """Yield the step on what had run out before something was judged or signed, whatever the clock said.

    what: the event; when: its time. before: latest times of the events before it. ends: what runs out -> its last day
    or moment, ISO 8601. After a time that has passed the clock was set back: the step is not complete. One that has not
    come yet shows as well that the clock was ahead once: the first line says so."""
    for latest in before:
        ended = [name for name, end in ends.items() if end < latest[: len(end)]]
        if ended and when < datetime.fromisoformat(latest) - CLOCK_SLACK:
            ahead = datetime.fromisoformat(latest) > now
            dated = f"{what} is dated {when:%Y-%m-%d}, and an event before it {latest[:10]}"
            words = f"the clock {'is or was wrong' if ahead else 'was set back'}: {dated}, when {ended[0]} had run out"
            yield Step(words, complete=ahead, remark=words if ahead else "")
            return


def runs_out(rows: Iterable[Mapping[str, Any]], signer: Signed | None) -> dict[str, str]:
    """Return what runs out behind a judgement or a signature, in words -> its last day or moment. rows: of the stated
    calibration."""
    ends = {f"the calibration of {row['name']}": str(row["due"]) for row in rows if row["due"]}
    key = {} if signer is None else {f"the key of {signer.person}": signer.certificate.not_valid_after_utc.isoformat()}
    return ends | key
