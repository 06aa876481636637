"""A record: channels sampled together on one time base."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from checks.arrays import Array
from checks.cause import Cause, because
from checks.errors import RecordError

MOTIONS = ("de", "da")  # channels of the payload's motion: the encoder on the strut, the interferometer


def motion_of(channels: Collection[str]) -> str:
    """Return the channel of the payload's motion: de, or da of a strut without encoder."""
    return next((c for c in MOTIONS if c in channels), MOTIONS[-1])


@dataclass(frozen=True, eq=False)
class Record:
    """Uniformly sampled channels.

    t : (N,) time [s], increasing; channels : name -> (N,) finite values in `units[name]`.
    name : its origin, for messages; sha256 : hash of the source file ("" if it did not come from a file); remarks : how
    its columns were read, if not as they are.
    """

    t: Array
    channels: Mapping[str, Array]
    units: Mapping[str, str]
    name: str = "record"
    sha256: str = ""
    remarks: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"Record({self.name}: {', '.join(self.channels)}; {self.t.size} samples at {self.fs:.6g} Hz)"

    def __getitem__(self, channel: str) -> Array:
        try:
            return self.channels[channel]
        except KeyError:
            raise RecordError(because(Cause.CHANNEL_MISSING, file=self.name, channel=channel)) from None

    @property
    def fs(self) -> float:
        """Return the sampling frequency [Hz], from the whole length so that one jittered sample does not matter."""
        return float((self.t.size - 1) / (self.t[-1] - self.t[0]))

    @property
    def duration(self) -> float:
        """Return the time from the first to the last sample [s]."""
        return float(self.t[-1] - self.t[0])
