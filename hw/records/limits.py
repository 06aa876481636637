"""How much a record file may hold before it is refused unread."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ReadLimits:
    """max_bytes: of the file; max_samples: of all channels together, time included; min_samples: of each channel.

    A bench record is some 20 MB; half a gigabyte is twenty times that, and 2e8 samples fill 1.6 GB of memory. Below
    16 samples no check has anything to average.
    """

    max_bytes: int = 512 * 1024**2
    max_samples: int = 200_000_000
    min_samples: int = 16


DEFAULT_LIMITS = ReadLimits()
