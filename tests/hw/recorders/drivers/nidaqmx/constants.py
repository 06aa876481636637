from enum import Enum


class AcquisitionType(Enum):
    FINITE = 10178
    CONTINUOUS = 10123


class Edge(Enum):
    RISING = 10280


class TerminalConfiguration(Enum):
    DEFAULT = -1
    RSE = 10083
    NRSE = 10078
    DIFF = 10106
    PSEUDO_DIFF = 12529


class Coupling(Enum):
    AC = 10045
    DC = 10050


class ExcitationSource(Enum):
    INTERNAL = 10200


class ExcitationVoltageOrCurrent(Enum):
    USE_CURRENT = 10134
