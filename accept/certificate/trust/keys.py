"""The bench's keys: an authority, and a key for each person in a role, kept encrypted under `home()/keys`.

The authority's key has a passphrase of its own and can be kept off the bench: without it the bench signs and verifies,
but an operator cannot make himself quality assurance. `accept.certificate.trust.key_changes` issues, renews and
revokes.
"""

import os
import platform
import re
import secrets
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
from cryptography.hazmat.primitives.serialization import Encoding

from accept.base.atomic_files import write_new
from accept.base.names import KeyHolder, same_person, scripts
from accept.certificate.trust import authority, encrypted_key, revocation, revocation_record
from accept.certificate.trust.authority import BENCH, QA, ROLES, TECHNICIAN, public_of
from accept.store import BENCH_KEY, bench_of, own_key
from specs.errors import AcceptError
from specs.files import read_bounded

CA = "ca"
PASSPHRASE, PASSPHRASE_FILE = "ACCEPT_PASSPHRASE", "ACCEPT_PASSPHRASE_FILE"
AUTHORITY_PASSPHRASE = "authority-passphrase.txt"  # holds a generated passphrase until its owner takes it
SHORTEST_PASSPHRASE = 8  # characters (NIST SP 800-63B, 5.1.1.1)
WARN_BEFORE = timedelta(days=60)


class KeysError(AcceptError, RuntimeError):
    """Keys that are missing, exist already or do not open; the text names the file and what to do."""


@dataclass(frozen=True)
class KeyInfo:
    """The line of `list` on one key, without any secret. revoked: since when, None if it is not."""

    role: str
    person: str
    valid_from: datetime
    valid_to: datetime
    sha256: str
    revoked: datetime | None = None


@dataclass(frozen=True, eq=False)
class Credential:
    """An opened key with its certificate and that of the bench's CA; no key if a token holds it.

    tsa: URL of the time stamping authority that is asked about what it signs, None for none; tsa_roots: of those that
    the bench trusts."""

    role: str
    key: ec.EllipticCurvePrivateKey | None
    certificate: x509.Certificate
    ca: x509.Certificate
    tsa: str | None = None
    tsa_roots: Sequence[x509.Certificate] = ()

    @property
    def person(self) -> KeyHolder:
        return KeyHolder(authority.person_of(self.certificate))

    @property
    def demo(self) -> bool:
        return authority.is_demo(self.ca)

    def warning(self, now: datetime) -> str | None:
        """Return a warning that the key expires soon, None if it does not."""
        left = self.certificate.not_valid_after_utc - now
        if left > WARN_BEFORE:
            return None
        day = f"{self.certificate.not_valid_after_utc:%Y-%m-%d}"
        return f"the key of {self.person} ({self.role}) is valid until {day}; `accept keys renew` renews it"


def folder(home: Path) -> Path:
    """Return the folder of the keys in the bench's folder."""
    return home / "keys"


def exist(home: Path) -> bool:
    """Return whether the bench has its authority's certificate."""
    return (folder(home) / f"{CA}.pem").is_file()


def init(
    home: Path,
    passphrase: str,
    technician_name: str,
    qa_name: str | None = None,
    qa_passphrase: str | None = None,
    when: datetime | None = None,
    *,
    authority_passphrase: str | None = None,
    demo: bool = False,
    bench_key: Path | None = None,
    office: Path | None = None,
) -> Path:
    """Make the authority, the technician's key and the certificate of the bench, all or none, and return their folder.

    qa_name, qa_passphrase: make a QA key too, of another person and with a passphrase of its own. authority_passphrase:
    if None, one is generated and left in `authority-passphrase.txt` of the folder, for its owner to take off the bench.
    demo: an authority that only demonstrations trust. bench_key: the bench's own key, by default in `home`. office:
    folder off the bench, such as a memory stick, for the authority's key and passphrase; by default the bench's. Raises
    KeysError if there are keys already, a name is empty or taken twice, a passphrase is too short or used twice, or a
    folder cannot be written.
    """
    for place in (folder(home), *([office] if office else [])):
        if (place / f"{CA}.pem").is_file():
            raise KeysError(f"{place}: there are keys already; move them away to make new ones")
    check_name(technician_name)
    check_passphrase(passphrase)
    try:
        bench = own_key(bench_key or home / BENCH_KEY).public_key()
    except OSError as e:
        raise KeysError(f"{e.filename or home}: the bench's own key cannot be written ({e.strerror})") from e
    persons = {TECHNICIAN: (technician_name, passphrase)}
    if qa_name is not None:
        check_name(qa_name)
        check_passphrase(qa_passphrase or "")
        if same_person(technician_name, qa_name):
            raise KeysError(f"{technician_name} cannot be both technician and quality assurance; no key was made")
        if qa_passphrase == passphrase:
            raise KeysError("quality assurance needs a passphrase of its own; no key was made")
        persons[QA] = (qa_name, qa_passphrase or "")
    if authority_passphrase is not None:
        check_passphrase(authority_passphrase)
        if not demo and authority_passphrase in (passphrase, qa_passphrase):  # that of a demonstration is no secret
            raise KeysError("the authority needs a passphrase of its own; no key was made")
    now = (when or datetime.now(UTC)).replace(microsecond=0)
    files = _make(persons, bench, authority_passphrase, now, demo)
    taken_off = (f"{CA}.key.pem", AUTHORITY_PASSPHRASE) if office else ()
    written: list[Path] = []
    try:
        for name in (f"{CA}.pem", revocation.FILE, *taken_off) if office else ():
            if office and name in files:
                office.mkdir(parents=True, exist_ok=True)
                write_new(office / name, files[name])
                written.append(office / name)
        _place({name: content for name, content in files.items() if name not in taken_off}, folder(home))
    except OSError as e:
        for path in written:
            path.unlink(missing_ok=True)
        raise KeysError(f"{e.filename or folder(home)}: keys cannot be written ({e.strerror})") from e
    return folder(home)


def unlock(
    home: Path, role: str, passphrase: str, person: str | None = None, now: datetime | None = None
) -> Credential:
    """Return the opened key of a role, of the person named if several have one. Raises KeysError, also if the key has
    expired or was revoked: its signatures would not verify."""
    if role not in ROLES:
        raise KeysError(f"no role '{role}' (roles: {', '.join(ROLES)})")
    path = _chosen(home, role, person)
    box = path.with_name(f"{path.stem}.key.pem")
    key = unlocked(box, passphrase)
    certificate = certificate_of(path)
    if key.public_key() != certificate.public_key():
        raise KeysError(f"{box}: is not the key of {path.name}")
    credential = Credential(role, key, certificate, ca(home))
    check_usable(home, credential, now or datetime.now(UTC))
    return credential


def check_usable(home: Path, credential: Credential, now: datetime) -> None:
    """Raise KeysError if a signature made now with this key would not verify."""
    certificate = credential.certificate
    who = f"the key of {credential.person} ({credential.role})"
    if now > certificate.not_valid_after_utc:
        raise KeysError(f"{who} ran out on {certificate.not_valid_after_utc:%Y-%m-%d}; `accept keys renew` renews it")
    if now < certificate.not_valid_before_utc:
        raise KeysError(f"{who} is valid from {certificate.not_valid_before_utc:%Y-%m-%d %H:%M} UTC: check the clock")
    if not authority.issued_by(certificate, credential.ca):
        raise KeysError(f"{who} was not issued by the authority of this bench, {CA}.pem")
    since = _revoked_since(home, certificate)
    if since is not None:
        raise KeysError(f"{who} was revoked on {since:%Y-%m-%d}; it signs no more")
    if not credential.demo:
        problem, never = revocation_record.fault_here(home, folder(home) / revocation.FILE, credential.ca)
        if problem and not never:
            raise KeysError(f"{problem}; nothing is signed")


def person_files(home: Path, role: str | None = None) -> Iterator[Path]:
    """Yield the certificate files of persons at this bench, only those of a role if `role` is given."""
    for path in sorted(folder(home).glob("*.pem"), reverse=True):  # technicians first
        others = path.name in (f"{CA}.pem", f"{BENCH}.pem", revocation.FILE)
        if others or path.name.endswith((".key.pem", ".request.pem")):
            continue
        if role is None or authority.role_of(certificate_of(path)) == role:
            yield path


def persons(home: Path, role: str) -> list[str]:
    """Return the names of those who have a key in a role at this bench. Raises KeysError."""
    return [authority.person_of(certificate_of(path)) for path in person_files(home, role)]


def list_file(home: Path) -> Path:
    """Return the file of the keys that the bench's authority revoked."""
    return folder(home) / revocation.FILE


def opens_a_key(home: Path, text: str) -> bool:
    """Return whether text is the passphrase of a key at this bench: of a person, of quality assurance, of the
    authority."""
    boxes = sorted(folder(home).glob("*.key.pem"))
    return any(_opens(path, typed) for path in boxes for typed in dict.fromkeys((text.strip(), text)))


def _opens(path: Path, passphrase: str) -> bool:
    """Return whether a passphrase opens a key. No passphrase opens a key that has none or that cannot be read."""
    try:
        box = read_key_file(path)
        if b"ENCRYPTED" in box:
            encrypted_key.unlock(box, passphrase)
            return True
    except (KeysError, encrypted_key.LockedError, OSError):
        pass
    return False


def _chosen(home: Path, role: str, person: str | None) -> Path:
    there = {path: authority.person_of(certificate_of(path)) for path in person_files(home, role)}
    fitting = [path for path, name in there.items() if person is None or same_person(name, person)]
    if len(fitting) == 1:
        return fitting[0]
    if not exist(home):
        raise KeysError(f"{folder(home)}: there are no keys; `accept keys init` makes keys")
    if not there:
        raise KeysError(f"{folder(home)}: no key for the role '{role}'; `accept keys request` makes one for a person")
    whose = ", ".join(there.values())
    if person is None:
        raise KeysError(f"{folder(home)}: several persons have a key as {role} ({whose}); name one with --operator")
    raise KeysError(f"{folder(home)}: {person} has no key as {role} (there are keys of {whose}); `accept keys request`")


def ca(home: Path) -> x509.Certificate:
    """Return the bench's CA certificate: what `verify` trusts by default. Raises KeysError."""
    return certificate_of(folder(home) / f"{CA}.pem")


def bench_name() -> str:
    """Return the default name of a bench: that of its machine."""
    plain = "".join(c for c in platform.node() if c.isascii() and (c.isalnum() or c in "._-"))
    return f"bench {plain[:50]}".strip()


def bench_certificate(home: Path, ca: x509.Certificate) -> x509.Certificate | None:
    """Return the certificate that an authority gave this bench, None if none is for the bench's own key: a second
    folder with copied keys is another bench. Raises KeysError."""
    path = folder(home) / f"{BENCH}.pem"
    if not path.is_file():
        return None
    certificate, own = certificate_of(path), bench_of(home / BENCH_KEY)
    is_own = own is not None and public_of(certificate) == own and authority.issued_by(certificate, ca)
    return certificate if is_own else None


def bench_problem(home: Path) -> str:
    """Return why this home is not the bench that its bench.pem names: the bench's own key is missing or another; "" if
    it is, or has no bench.pem. Raises KeysError."""
    path, key = folder(home) / f"{BENCH}.pem", home / BENCH_KEY
    if not path.is_file() or (own := bench_of(key)) == public_of(certificate := certificate_of(path)):
        return ""
    what = f"{key} is the key of another bench" if own else f"its key, {key}, is missing"
    return (
        f"{path} names {authority.person_of(certificate)}, but {what}: put back {BENCH_KEY} and the store of that "
        "bench, or ask for a certificate of this one: accept keys request --role bench --name NAME"
    )


def certified_bench(home: Path) -> str | None:
    """Return the public key of the bench that bench.pem names, None without one. Raises KeysError."""
    path = folder(home) / f"{BENCH}.pem"
    return public_of(certificate_of(path)) if path.is_file() else None


def authority_here(home: Path) -> bool:
    """Return whether the authority's key lies at this bench: a person who opens it can sign as anyone."""
    return (folder(home) / f"{CA}.key.pem").is_file()


def stamping_files(home: Path) -> list[Path]:
    """Return the files of the time stamping authorities that the bench trusts: tsa.pem, tsa-NAME.pem."""
    return sorted(folder(home).glob("tsa*.pem"))


def stamping_roots(home: Path) -> list[x509.Certificate]:
    """Return the root certificates of the time stamping authorities that the bench trusts. Raises KeysError."""
    return [certificate_of(path) for path in stamping_files(home)]


def stamping(credential: Credential, url: str | None, home: Path) -> Credential:
    """Return the credential with the time stamping authority at a URL, unchanged without a URL. Raises KeysError."""
    return replace(credential, tsa=url, tsa_roots=stamping_roots(home)) if url else credential


def revoked(home: Path) -> list[revocation.Revoked]:
    """Return the certificates that the bench's authority revoked. Raises RevocationError."""
    return revocation.revoked_in(folder(home) / revocation.FILE, ca(home))


def certificate_of(path: Path) -> x509.Certificate:
    """Return the certificate in a PEM or DER file. Raises KeysError."""
    content = read_key_file(path)
    try:
        if content.lstrip().startswith(b"-----BEGIN"):
            return x509.load_pem_x509_certificate(content)
        return x509.load_der_x509_certificate(content)
    except ValueError as e:
        raise KeysError(f"{path}: is not a certificate (PEM or DER expected)") from e


def listing(home: Path) -> list[KeyInfo]:
    """Return the CA and every person's key. Raises KeysError if there are no keys."""
    found = [(CA, ca(home))]
    found += [(authority.role_of(c), c) for c in map(certificate_of, person_files(home))]
    own = bench_certificate(home, ca(home))
    found += [] if own is None else [(BENCH, own)]
    return [
        KeyInfo(
            role, authority.person_of(c), c.not_valid_before_utc, c.not_valid_after_utc, authority.fingerprint(c),
            _revoked_since(home, c),
        )
        for role, c in found
    ]  # fmt: skip


def exposed(home: Path) -> list[Path]:
    """Return the files with keys or passphrases that other users than their owner may read."""
    if os.name != "posix":
        return []
    secret = [*folder(home).glob("*.key.pem"), folder(home) / AUTHORITY_PASSPHRASE]
    return [path for path in secret if path.is_file() and path.stat().st_mode & 0o077]


def passphrase(given: str | None = None, prompt: Callable[[], str] | None = None) -> str:
    """Return the passphrase from the argument, `ACCEPT_PASSPHRASE`, the file `ACCEPT_PASSPHRASE_FILE`, or the prompt.

    prompt: asks the person; None if there is no terminal. Raises KeysError if nothing gives one.
    """
    file = os.environ.get(PASSPHRASE_FILE)
    found = given or os.environ.get(PASSPHRASE)
    if not found and file:
        found = read_key_file(Path(file)).decode("utf-8", "strict").rstrip("\r\n")
    if not found and prompt is not None:
        found = prompt()
    if not found:
        raise KeysError(f"no passphrase: set {PASSPHRASE} or {PASSPHRASE_FILE}, or run in a terminal")
    return found


def check_name(name: str) -> None:
    """Raise KeysError if a certificate cannot hold the name."""
    if not name.strip() or not name.isprintable() or len(name) > 64 or "=" in name:  # as in "Bob, OU=technician"
        raise KeysError(f"name {name!r}: expected 1 to 64 printable characters without '='; no key was made")
    if len(mixed := scripts(name)) > 1:
        words = " and ".join(sorted(s.capitalize() for s in mixed))
        raise KeysError(f"name {name!r}: has letters of several scripts ({words}), which look alike; no key was made")


def check_passphrase(chosen: str) -> None:
    """Raise KeysError if a new passphrase is too short. An existing one is not checked."""
    if len(chosen) < SHORTEST_PASSPHRASE:
        expected = f"expected {SHORTEST_PASSPHRASE} or more"
        raise KeysError(f"the passphrase has {len(chosen)} characters, {expected}; no key was made")


def key_name(home: Path, role: str, person: str) -> str:
    """Return a name for the files of a person's key that no file at this bench has yet."""
    plain = re.sub(r"[^a-z0-9]+", "-", person.casefold()).strip("-") or "person"
    tried, number = f"{role}-{plain}", 1
    while any(folder(home).glob(f"{tried}.*")):
        number += 1
        tried = f"{role}-{plain}-{number}"
    return tried


def unlocked(box: Path, passphrase: str) -> ec.EllipticCurvePrivateKey:
    """Return the private key in a file. Raises KeysError."""
    try:
        return encrypted_key.unlock(read_key_file(box), passphrase)
    except encrypted_key.LockedError as e:
        raise KeysError(f"{box}: {e}") from e


def read_key_file(path: Path) -> bytes:
    """Return the content of a key file. Raises KeysError."""
    try:
        return read_bounded(path)
    except OSError as e:
        at_office = path.name == f"{CA}.key.pem"
        way = "--authority FOLDER names where it lies" if at_office else "`accept keys init` makes keys"
        raise KeysError(f"{path}: cannot be read ({e.strerror}); {way}") from e


def _revoked_since(home: Path, certificate: x509.Certificate) -> datetime | None:
    return next((r.since for r in revoked(home) if r.serial_number == certificate.serial_number), None)


def _make(
    persons: dict[str, tuple[str, str]],
    bench: Ed25519PublicKey,
    authority_passphrase: str | None,
    now: datetime,
    demo: bool,
) -> dict[str, bytes]:
    ca_key = authority.new_key()
    root = authority.root(ca_key, now, demo)
    chosen = authority_passphrase or secrets.token_urlsafe(18)
    files = {f"{CA}.pem": root.public_bytes(Encoding.PEM), f"{CA}.key.pem": encrypted_key.lock(ca_key, chosen)}
    if authority_passphrase is None:
        files[AUTHORITY_PASSPHRASE] = f"{chosen}\n".encode("ascii")
    if not demo:
        files[revocation.FILE] = revocation.made(root, ca_key, when=now)
    own = authority.leaf(BENCH, bench_name(), bench, root, ca_key, now)
    files[f"{BENCH}.pem"] = own.public_bytes(Encoding.PEM)
    for role, (person, passphrase) in persons.items():
        key = authority.new_key()
        certificate = authority.leaf(role, person, key.public_key(), root, ca_key, now)
        files[f"{role}.pem"] = certificate.public_bytes(Encoding.PEM)
        files[f"{role}.key.pem"] = encrypted_key.lock(key, passphrase)
    return files


def _place(files: dict[str, bytes], target: Path) -> None:
    """Write the folder beside its place and rename it: a crash leaves all keys or none."""
    target.parent.mkdir(parents=True, exist_ok=True)
    temporary = Path(tempfile.mkdtemp(dir=target.parent, prefix=".keys."))
    try:
        for name, content in files.items():
            write_new(temporary / name, content)
        os.rename(temporary, target)  # fails if another process made keys meanwhile
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise
