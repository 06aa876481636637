"""The bench's keys: made once, kept encrypted under `home()/keys`, opened for signing with a passphrase."""

import os
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding

from accept.certificate import authority, encrypted_key
from specs.errors import AcceptError

TECHNICIAN, QA = "technician", "qa"
ROLES = (TECHNICIAN, QA)
CA = "ca"
PASSPHRASE, PASSPHRASE_FILE = "ACCEPT_PASSPHRASE", "ACCEPT_PASSPHRASE_FILE"


class KeysError(AcceptError, RuntimeError):
    """Keys that are missing, exist already or do not open; the text names the file and what to do."""


@dataclass(frozen=True)
class KeyInfo:
    """What `list` shows of one key; nothing in it is secret."""

    role: str
    person: str
    valid_from: datetime
    valid_to: datetime
    sha256: str


@dataclass(frozen=True, eq=False)
class Credential:
    """An opened key with its certificate and that of the bench's CA; no key where a token holds it."""

    role: str
    key: ec.EllipticCurvePrivateKey | None
    certificate: x509.Certificate
    ca: x509.Certificate

    @property
    def person(self) -> str:
        return authority.person_of(self.certificate)


def folder(home: Path) -> Path:
    """Folder of the keys in the bench's own."""
    return home / "keys"


def exist(home: Path) -> bool:
    """Whether the bench has its authority's certificate."""
    return (folder(home) / f"{CA}.pem").is_file()


def init(
    home: Path,
    passphrase: str,
    technician_name: str,
    qa_name: str,
    qa_passphrase: str | None = None,
    when: datetime | None = None,
) -> Path:
    """Make the CA and the keys of both roles, all or none; returns their folder.

    qa_passphrase: of the QA key (default: the same; four eyes are only real with one of its own).
    Raises KeysError when there are keys already, a name or passphrase is empty, or the folder cannot be written.
    """
    _refuse_empty(passphrase=passphrase, technician_name=technician_name, qa_name=qa_name)
    if exist(home):
        raise KeysError(f"{folder(home)}: there are keys already; move them away to make new ones")
    now = (when or datetime.now(UTC)).replace(microsecond=0)
    files = _make({TECHNICIAN: technician_name, QA: qa_name}, passphrase, qa_passphrase or passphrase, now)
    try:
        _place(files, folder(home))
    except OSError as e:
        raise KeysError(f"{folder(home)}: keys cannot be written ({e.strerror})") from e
    return folder(home)


def unlock(home: Path, role: str, passphrase: str) -> Credential:
    """Opened key of a role. Raises KeysError."""
    if role not in ROLES:
        raise KeysError(f"no role '{role}' (roles: {', '.join(ROLES)})")
    box = folder(home) / f"{role}.key.pem"
    key = _unlocked(box, passphrase)
    certificate = certificate_of(folder(home) / f"{role}.pem")
    if key.public_key() != certificate.public_key():
        raise KeysError(f"{box}: is not the key of {role}.pem")
    return Credential(role, key, certificate, ca(home))


def issue(
    home: Path, role: str, person: str, public_key: ec.EllipticCurvePublicKey, passphrase: str, when: datetime
) -> x509.Certificate:
    """Certificate of the bench's CA for a key that is elsewhere, such as on a token. Raises KeysError."""
    if role not in ROLES or not isinstance(public_key.curve, ec.SECP256R1):
        raise KeysError(f"a certificate is for a role ({', '.join(ROLES)}) and a P-256 key, not for {role}")
    ca_key = _unlocked(folder(home) / f"{CA}.key.pem", passphrase)
    return authority.leaf(role, person, public_key, ca(home), ca_key, when.replace(microsecond=0))


def ca(home: Path) -> x509.Certificate:
    """The bench's CA certificate: what `verify` trusts by default. Raises KeysError."""
    return certificate_of(folder(home) / f"{CA}.pem")


def certificate_of(path: Path) -> x509.Certificate:
    """The certificate in a PEM or DER file. Raises KeysError."""
    content = _read(path)
    try:
        if content.lstrip().startswith(b"-----BEGIN"):
            return x509.load_pem_x509_certificate(content)
        return x509.load_der_x509_certificate(content)
    except ValueError as e:
        raise KeysError(f"{path}: is not a certificate (PEM or DER expected)") from e


def listing(home: Path) -> list[KeyInfo]:
    """The CA and both roles. Raises KeysError when there are no keys."""
    found = [(name, certificate_of(folder(home) / f"{name}.pem")) for name in (CA, *ROLES)]
    return [
        KeyInfo(name, authority.person_of(c), c.not_valid_before_utc, c.not_valid_after_utc, authority.fingerprint(c))
        for name, c in found
    ]


def passphrase(given: str | None = None, prompt: Callable[[], str] | None = None) -> str:
    """Passphrase from the argument, `ACCEPT_PASSPHRASE`, the file `ACCEPT_PASSPHRASE_FILE`, or the prompt.

    prompt: asks the person; None where there is no terminal. Raises KeysError when nothing gives one.
    """
    file = os.environ.get(PASSPHRASE_FILE)
    found = given or os.environ.get(PASSPHRASE)
    if not found and file:
        found = _read(Path(file)).decode("utf-8", "strict").rstrip("\r\n")
    if not found and prompt is not None:
        found = prompt()
    if not found:
        raise KeysError(f"no passphrase: set {PASSPHRASE} or {PASSPHRASE_FILE}, or run in a terminal")
    return found


def _make(persons: dict[str, str], passphrase: str, qa_passphrase: str, now: datetime) -> dict[str, bytes]:
    ca_key = authority.new_key()
    root = authority.root(ca_key, now)
    files = {f"{CA}.pem": root.public_bytes(Encoding.PEM), f"{CA}.key.pem": encrypted_key.lock(ca_key, passphrase)}
    for role, person in persons.items():
        key = authority.new_key()
        certificate = authority.leaf(role, person, key.public_key(), root, ca_key, now)
        files[f"{role}.pem"] = certificate.public_bytes(Encoding.PEM)
        files[f"{role}.key.pem"] = encrypted_key.lock(key, qa_passphrase if role == QA else passphrase)
    return files


def _place(files: dict[str, bytes], target: Path) -> None:
    """Write the folder beside its place and rename it: a crash leaves all keys or none."""
    target.parent.mkdir(parents=True, exist_ok=True)
    temporary = Path(tempfile.mkdtemp(dir=target.parent, prefix=".keys."))
    try:
        for name, content in files.items():
            handle = os.open(temporary / name, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with os.fdopen(handle, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
        os.rename(temporary, target)  # fails when another process made keys meanwhile
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise


def _refuse_empty(**texts: str) -> None:
    for name, text in texts.items():
        if not text.strip():
            raise KeysError(f"{name.replace('_', ' ')} is empty; no key was made")


def _unlocked(box: Path, passphrase: str) -> ec.EllipticCurvePrivateKey:
    try:
        return encrypted_key.unlock(_read(box), passphrase)
    except encrypted_key.LockedError as e:
        raise KeysError(f"{box}: {e}") from e


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as e:
        raise KeysError(f"{path}: cannot be read ({e.strerror}); `accept keys init` makes keys") from e
