"""Limits of a record file, beyond which it is refused unread."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ReadLimits:
    """Largest and smallest record that is read. max_bytes: of the file; max_samples: of all channels together, time
    included; min_samples: of each channel.

    A bench record is some 20 MB with 2e6 samples; half a gigabyte and 4e7 samples are twenty times that. As numbers 4e7
    samples fill 0.32 GB, of which an analysis makes up to ten more: the limit of a worker. Below 16 samples no check
    has anything to average."""

    max_bytes: int = 512 * 1024**2
    max_samples: int = 40_000_000
    min_samples: int = 16


DEFAULT_LIMITS = ReadLimits()
