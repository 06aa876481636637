"""Find ports and network instruments, and propose an entry of a bench file for each.

Nothing is written to an instrument that is not known. A serial port is only opened and listened to. On VISA and at an
address that is named, one question that changes nothing is asked: `*IDN?`, or the device's name."""

import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from serial.tools.list_ports import comports

from hw.errors import Garbled, InstrumentError, InstrumentRefused
from hw.instruments import ids3010
from hw.instruments.scpi_lcr import PROFILES
from hw.link import Link
from hw.network_port import Address, open_tcp, visa_opener
from hw.serial_port import LineSettings
from specs.distribution import install

LISTEN_S, ANSWER_S = 0.3, 1.0  # instruments that send by themselves do so more often; for an answer to `*IDN?`
IDN = "*IDN?\n"
HOST_NUMBER = re.compile(r"[\w.-]+:\d+")  # an address, and not a VISA name
ASKED = ("TCPIP", "USB", "GPIB")  # VISA interfaces with an instrument at the other end
ADAPTERS = re.compile(r"FTDI|FT232|CP210|CH340|PL2303|USB|UART|ACM|COM", re.IGNORECASE)


class Found(NamedTuple):
    """Where an instrument may be: port, address or VISA name; found: in words; entry: of the bench file, or ""."""

    place: str
    found: str
    entry: str


def find_instruments(named: Sequence[str], library: str, note: Callable[[str], object]) -> Iterator[Found]:
    """Yield what each serial port, named address and VISA name has, in this order.

    named: VISA names and `host:number` to ask too; library: of VISA; note: takes the reason why VISA finds none."""
    for port in sorted(comports(), key=lambda p: p.device):
        yield _listen(port.device, port.description or "")
    on_network = [name for name in named if HOST_NUMBER.fullmatch(name)]
    yield from map(_device, on_network)
    yield from _visa([name for name in named if name not in on_network], library, note)


def _listen(port: str, description: str) -> Found:
    """Open a port and listen to it; not a byte is sent."""
    link = Link(LineSettings(port, 9600, 8, "none", 1, "none"))
    try:
        link.drop_until_quiet(LISTEN_S, link.deadline(2 * LISTEN_S))
        heard = b"".join(t.data for t in link.take_transcript() if t.way == "read")
        words = f"free, {'silent' if not heard else f'sends by itself ({heard[:20]!r})'}"
    except InstrumentError as e:
        words = str(e).partition(": ")[2]
    finally:
        link.close()
    entry = (
        "# [instruments.NAME]            # a gauge: millimar; a readout: nd287, nd281b; an LCR-800: lcr800\n"
        f'# driver = "..."\n# measures = ["..."]\n# link = {{ port = "{port}", baud = 9600, data_bits = 7, '
        'parity = "even", stop_bits = 2, handshake = "none" }\n'
    )
    return Found(port, f"{description}; {words}", entry if ADAPTERS.search(f"{port} {description}") else "")


def _device(address: str) -> Found:
    """Ask a device on the network for its name, as of an IDS3010; this changes nothing."""
    link = Link(Address(address), open_tcp)
    try:
        names = []
        for number, what in enumerate(("getDeviceName", "getSerialNumber")):
            method = f"{ids3010.SYSTEM}.{what}"
            link.send(ids3010.request(method, number))
            line = link.read_until(ids3010.END, link.deadline(2 * ANSWER_S))
            names.append(re.sub(r"[^\w .-]", "", str(ids3010.first_value(address, line, method, number))))
    except (Garbled, InstrumentRefused):
        return Found(address, "answers, but not as an IDS3010", "")
    except InstrumentError as e:
        return Found(address, str(e).partition(": ")[2], "")
    finally:
        link.close()
    entry = (
        f'[instruments.interferometer]\ndriver = "ids3010"\nmeasures = ["stiffness"]\nserial = "{names[1]}"\n'
        f'resource = "{address}"\n# settings = {{ axis = 0, pass_mode = 0, range_mm = [-1.0, 1.0] }}\n'
        '# calibration = { certificate = "...", due = 2027-01-01 }\n'
    )
    return Found(address, f"{names[0]} {names[1]}: ids3010", entry)


def _visa(named: Sequence[str], library: str, note: Callable[[str], object]) -> Iterator[Found]:
    try:
        import pyvisa
    except ImportError:
        note(f"VISA instruments are not looked for: {install('visa')}")
        return
    try:
        with warnings.catch_warnings(record=True) as left_out:  # places that could not be searched, with the remedy
            warnings.simplefilter("always")
            warnings.simplefilter("ignore", ResourceWarning)  # sockets that the search leaves open
            found = pyvisa.ResourceManager(library).list_resources("?*")
        for warning in left_out:
            note(f"VISA: {warning.message}")
    except (pyvisa.errors.Error, OSError, ValueError) as e:
        note(f"VISA: {e}")
        found = ()
    # The interfaces to ask are listed, not those to leave out: a library may have names of its own for serial ports, as
    # PRLGX-ASRL, and would write to them.
    instruments = [r for r in found if r.partition("::")[0].rstrip("0123456789") in ASKED]
    yield from (_identify(resource, library) for resource in (*instruments, *named))


def _identify(resource: str, library: str) -> Found:
    """Ask a VISA instrument for `*IDN?`, which all support and which changes nothing."""
    link = Link(Address(resource), visa_opener(library, ANSWER_S))
    try:
        link.send(IDN.encode("ascii"))
        answer = link.read_until(b"\n", link.deadline(2 * ANSWER_S)).strip().decode("ascii", "replace")
    except InstrumentError as e:
        return Found(resource, str(e).partition(": ")[2], "")
    finally:
        link.close()
    fields = [re.sub(r"[^\w .,/+-]", "", field).strip() for field in answer.split(",")]
    profile = next((n for n, p in PROFILES.items() if len(fields) > 2 and re.fullmatch(p.models, fields[1])), None)
    if profile is None:
        return Found(resource, f"{answer!r}: no driver here knows it", "")
    entry = (
        f'[instruments.lcr]\ndriver = "scpi_lcr"\nmeasures = ["capacitance"]\nmodel = "{fields[1]}"\n'
        f'serial = "{fields[2]}"\nresource = "{resource}"\nsettings = {{ profile = "{profile}" }}\n'
        '# calibration = { certificate = "...", due = 2027-01-01 }\n'
    )
    return Found(resource, f"{answer!r}: scpi_lcr", entry)
