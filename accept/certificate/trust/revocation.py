"""Revoked keys: the authority's signed list (CRL, RFC 5280), which counts from the date of each entry."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding

from accept.judging.decisions import is_lost
from specs.errors import AcceptError
from specs.files import read_bounded

FILE = "ca.crl.pem"
REASONS = {
    "left": x509.ReasonFlags.affiliation_changed,
    "lost": x509.ReasonFlags.key_compromise,  # the finder of a lost key may use it
    "compromised": x509.ReasonFlags.key_compromise,
}
CLOCK_SLACK = timedelta(hours=24)  # between the clocks of two machines, as for signatures
_LIFE = timedelta(days=365 * 20)  # the list is valid until the next one; it is not fetched from a network


class RevocationError(AcceptError, ValueError):
    """A list of revoked keys that cannot be used; the text names the file and what is wrong."""


@dataclass(frozen=True)
class Revoked:
    """A revoked certificate: its number, since when, and whether another person may hold its key, because it was
    compromised or lost, which are the same to a recipient of its signatures."""

    serial_number: int
    since: datetime
    compromised: bool


@dataclass(frozen=True)
class RevocationList:
    """An authority's list. number: grows with every change (the CRL number); dated: when it was signed; text: PEM."""

    number: int
    entries: tuple[Revoked, ...]
    dated: datetime
    text: str

    def lacks(self, other: "RevocationList") -> bool:
        """Return whether another list of the same authority is newer or has a key that this one has not."""
        keys, others = ({entry.serial_number for entry in one.entries} for one in (self, other))
        return other.number > self.number or not others <= keys

    @property
    def from_the_future(self) -> bool:
        """Whether it is dated after the present moment, by more than clocks differ."""
        return self.dated > datetime.now(UTC) + CLOCK_SLACK


def aged(when: datetime) -> str:
    """Return the age of a list as it stands behind its day."""
    days = (datetime.now(UTC) - when).days
    return f" ({'today' if days < 1 else '1 day ago' if days == 1 else f'{days} days ago'})"


def read_list(path: Path, ca: x509.Certificate) -> RevocationList | None:
    """Return an authority's list, None if the file does not exist. Raises RevocationError if the list is damaged or is
    not signed by this authority."""
    content = _read(path)
    return None if content is None else parsed(content, str(path), ca)


def revoked_in(path: Path, ca: x509.Certificate) -> list[Revoked]:
    """Return the entries of an authority's list, none if the file does not exist. Raises RevocationError."""
    found = read_list(path, ca)
    return [] if found is None else list(found.entries)


def merged(lists: Iterable[RevocationList]) -> list[Revoked]:
    """Return the entries of several lists of an authority; of a key in several, that of the newest list."""
    found: dict[int, Revoked] = {}
    for one in sorted(lists, key=lambda each: each.number):
        found |= {entry.serial_number: entry for entry in one.entries}
    return list(found.values())


def kept(path: Path) -> str | None:
    """Return the present list, to be attached to a certificate; None if the file does not exist. Raises
    RevocationError."""
    content = _read(path)
    return None if content is None else content.decode("ascii", "replace")


def _read(path: Path) -> bytes | None:
    try:
        return read_bounded(path)
    except FileNotFoundError:
        return None
    except OSError as e:
        raise RevocationError(f"{path}: cannot be read ({e.strerror})") from e


def parsed(content: bytes, path: str, ca: x509.Certificate) -> RevocationList:
    """Return a list; path: its name in messages. Raises RevocationError as `read_list`."""
    try:
        listed = x509.load_pem_x509_crl(content)
        key = ca.public_key()
        signed = isinstance(key, ec.EllipticCurvePublicKey) and listed.is_signature_valid(key)
        if not signed:
            raise RevocationError(f"{path}: is not signed by the authority {ca.subject.rfc4514_string()}")
        entries = tuple(Revoked(one.serial_number, one.revocation_date_utc, is_lost(one)) for one in listed)
        try:
            number = listed.extensions.get_extension_for_class(x509.CRLNumber).value.crl_number
        except x509.ExtensionNotFound:
            number = len(entries)
    except ValueError as e:
        if isinstance(e, RevocationError):
            raise
        raise RevocationError(f"{path}: is not a list of revoked keys ({e})") from e
    return RevocationList(number, entries, listed.last_update_utc, content.decode("ascii", "replace"))


def is_canonical(text: str) -> bool:
    """Return whether a list is exactly as `made` writes it, without any other text."""
    try:
        return x509.load_pem_x509_crl(text.encode()).public_bytes(Encoding.PEM).decode("ascii") == text
    except ValueError:
        return False


def beside(ca_path: Path) -> Path:
    """Return the file of an authority's list: `ca.crl.pem` for `ca.pem`."""
    return ca_path.with_suffix(".crl.pem")


def made(
    ca: x509.Certificate,
    key: ec.EllipticCurvePrivateKey,
    entries: Sequence[Revoked] = (),
    number: int = 0,
    when: datetime | None = None,
) -> bytes:
    """Return a list with these entries, PEM. number: the lowest that it may have; it is at least that of entries."""
    now = (when or datetime.now(UTC)).replace(microsecond=0)
    builder = x509.CertificateRevocationListBuilder().issuer_name(ca.subject)
    builder = builder.last_update(now).next_update(now + _LIFE)
    for entry in entries:
        reason = REASONS["compromised" if entry.compromised else "left"]
        one = x509.RevokedCertificateBuilder().serial_number(entry.serial_number).revocation_date(entry.since)
        builder = builder.add_revoked_certificate(one.add_extension(x509.CRLReason(reason), critical=False).build())
    builder = builder.add_extension(x509.CRLNumber(max(number, len(entries))), critical=False)
    return builder.sign(key, hashes.SHA256()).public_bytes(Encoding.PEM)
