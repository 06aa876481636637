"""The life of a person's key: requested at the bench, issued, renewed and revoked by the authority."""

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509.oid import NameOID

from accept.base.atomic_files import write_atomic, write_new
from accept.base.names import KeyHolder, same_person
from accept.certificate.trust import authority, encrypted_key, keys, revocation, revocation_record
from accept.certificate.trust.authority import BENCH, ROLES, public_of
from accept.certificate.trust.keys import CA, KeysError
from accept.certificate.trust.revocation import REASONS, RevocationList, Revoked
from accept.store import BENCH_KEY, bench_of, open_store, own_key

ISSUED = "issued"  # the certificates that the authority issued, one a file


def request(home: Path, role: str, person: str, passphrase: str) -> tuple[Path, bytes]:
    """Make a person's key at this bench; returns its file and the request for the authority (PKCS #10, PEM).

    Raises KeysError, OSError.
    """
    if role not in (*ROLES, BENCH):
        raise KeysError(f"no role '{role}' (roles: {', '.join((*ROLES, BENCH))})")
    keys.check_name(person)
    if role == BENCH:
        return _request_of_bench(home, person)
    keys.check_passphrase(passphrase)
    key = authority.new_key()
    asked = x509.CertificateSigningRequestBuilder().subject_name(authority.subject(person, role))
    text = asked.sign(key, hashes.SHA256()).public_bytes(Encoding.PEM)
    place = keys.folder(home)
    place.mkdir(parents=True, exist_ok=True, mode=0o700)
    name = keys.key_name(home, role, person)
    write_new(place / f"{name}.key.pem", encrypted_key.lock(key, passphrase))
    write_atomic(place / f"{name}.request.pem", text)
    return place / f"{name}.key.pem", text


def _request_of_bench(home: Path, name: str) -> tuple[Path, bytes]:
    key = own_key(home / BENCH_KEY)
    asked = x509.CertificateSigningRequestBuilder().subject_name(authority.subject(name, BENCH))
    text = asked.sign(key, None).public_bytes(Encoding.PEM)
    keys.folder(home).mkdir(parents=True, exist_ok=True, mode=0o700)
    write_atomic(keys.folder(home) / f"{BENCH}.request.pem", text)
    return home / BENCH_KEY, text


def issue_request(
    office: Path, content: bytes, passphrase: str, when: datetime | None = None, home: Path | None = None
) -> x509.Certificate:
    """Return the certificate for a request, issued by the authority whose files are in the folder `office`. home: as
    for `issue`. Raises KeysError."""
    try:
        asked = x509.load_pem_x509_csr(content)
    except ValueError as e:
        raise KeysError(f"is not a certificate request ({e})") from e
    key = asked.public_key()
    if not asked.is_signature_valid or not isinstance(key, ec.EllipticCurvePublicKey | Ed25519PublicKey):
        raise KeysError("the request is not signed by its own key, of P-256 for a person and Ed25519 for a bench")
    role, person = _one(asked, NameOID.ORGANIZATIONAL_UNIT_NAME), _one(asked, NameOID.COMMON_NAME)
    return issue(office, role, person, key, passphrase, when, home)


def issue(
    office: Path,
    role: str,
    person: str,
    public_key: authority.PublicKey,
    passphrase: str,
    when: datetime | None = None,
    home: Path | None = None,
) -> x509.Certificate:
    """Return the certificate of a person in a role for a key, such as a token's, or of a bench for its own key. office:
    folder of the authority. home: of the bench, whose list of revoked keys is mended if it is missing or old.

    Raises KeysError, also if this person or key is known in the other role: four eyes are those of two persons.
    """
    if isinstance(public_key, Ed25519PublicKey):
        fits = role == BENCH
    else:
        fits = role in ROLES and isinstance(public_key.curve, ec.SECP256R1)
    if not fits:
        roles = f"a role ({', '.join(ROLES)}) and a P-256 key, or for a bench and an Ed25519 key"
        raise KeysError(f"a certificate is for {roles}, not for {role!r}")
    keys.check_name(person)
    for known in _known(office):
        other = authority.role_of(known)
        if other != role and same_person(authority.person_of(known), person):
            raise KeysError(f"{person} is known as {other}; the same person cannot be {role} too")
        if other != role and known.public_key() == public_key:
            raise KeysError(f"the key is that of {authority.person_of(known)} as {other}; a key has one role")
    ca_key = keys.unlocked(office / f"{CA}.key.pem", passphrase)
    now = (when or datetime.now(UTC)).replace(microsecond=0)
    made = authority.leaf(role, person, public_key, keys.certificate_of(office / f"{CA}.pem"), ca_key, now)
    _write_list(home or office.parent, office, ca_key)
    _file(office, made)
    return made


def _file(office: Path, certificate: x509.Certificate) -> None:
    """Keep a certificate at the authority, which revokes by its number."""
    (office / ISSUED).mkdir(exist_ok=True)
    _put(office / ISSUED / f"{certificate.serial_number:x}.pem", certificate)


def install(home: Path, certificate: x509.Certificate) -> Path:
    """Put a certificate beside its key at this bench. Raises KeysError if the key is not here or the certificate is by
    another authority."""
    if keys.exist(home) and not authority.issued_by(certificate, keys.ca(home)):
        raise KeysError("the certificate was not issued by the authority of this bench")
    for path in sorted(keys.folder(home).glob("*.request.pem")):
        asked = x509.load_pem_x509_csr(keys.read_key_file(path))
        if asked.public_key() == certificate.public_key():
            return _put(path.with_name(path.name.replace(".request.pem", ".pem")), certificate)
    if public_of(certificate) is not None and public_of(certificate) == bench_of(home / BENCH_KEY):
        return _put(keys.folder(home) / f"{BENCH}.pem", certificate)
    for path in keys.person_files(home):
        if keys.certificate_of(path).public_key() == certificate.public_key():
            return _put(path, certificate)
    raise KeysError(f"{keys.folder(home)}: there is no key that this certificate is for")


def renew(home: Path, office: Path, who: str, passphrase: str, when: datetime | None = None) -> x509.Certificate:
    """Return a new certificate for the same person, role and key, and install it at this bench. Raises KeysError."""
    path = _path_of(home, who)
    old = keys.certificate_of(path)
    key = old.public_key()
    if not isinstance(key, ec.EllipticCurvePublicKey | Ed25519PublicKey):
        raise KeysError(f"{path}: is for no key of this kind")
    if any(r.serial_number == old.serial_number for r in keys.revoked(home)):
        raise KeysError(f"the key of {authority.person_of(old)} was revoked; a revoked key is not renewed")
    new = issue(office, authority.role_of(old), authority.person_of(old), key, passphrase, when, home)
    _file(office, old)  # it is valid still, and who revokes the key revokes both
    _put(path, new)
    return new


def revoke(home: Path, office: Path, who: str, reason: str, passphrase: str, since: datetime) -> list[str]:
    """Revoke every certificate of a person, or one by its sha256, from a moment on, and return their names. reason:
    `left`, `lost`, `compromised`. The list is written into `office` and to this bench, and stored as an event of the
    bench. Raises KeysError, RevocationError, StoreError."""
    if reason not in REASONS:
        raise KeysError(f"no reason '{reason}' (reasons: {', '.join(REASONS)})")
    meant = [c for c in _known(office) if _is(c, who)]
    if not meant:
        raise KeysError(f"{office}: no key of '{who}'; give the name or the sha256 that `accept keys list` shows")
    ca_key = keys.unlocked(office / f"{CA}.key.pem", passphrase)
    listed = _write_list(home, office, ca_key, [Revoked(c.serial_number, since, reason != "left") for c in meant])
    whose = sorted({f"{authority.person_of(c)} ({authority.role_of(c)})" for c in meant})
    if listed is not None and keys.exist(home) and not keys.bench_problem(home):
        ca = keys.ca(home)
        with open_store(*revocation_record.store_of(home), bench=home) as store:
            revocation_record.record(
                store, ca, listed, KeyHolder(authority.person_of(ca)), f"{', '.join(whose)}: {reason}"
            )
    return whose


def _write_list(
    home: Path, office: Path, ca_key: ec.EllipticCurvePrivateKey, new: Sequence[Revoked] = ()
) -> RevocationList | None:
    """Write the authority's list into its office and to a bench, with these entries added to those of every list that
    either has; return it, None if nothing was written. Without new entries only a list that is missing or older than
    another is written. Raises KeysError, RevocationError, StoreError, OSError."""
    ca, places, stored, stated = keys.certificate_of(office / f"{CA}.pem"), {office}, None, False
    if keys.exist(home) and keys.ca(home) == ca:
        places.add(keys.folder(home))
        stored, stated = revocation_record.newest_stored(home, ca)
    there = [revocation.read_list(place / revocation.FILE, ca) for place in places]
    known = [one for one in (*there, stored) if one is not None]
    newest = max(known, key=lambda one: one.number, default=None)
    if not new and newest is None and stated and not authority.promises_list(ca):
        return None  # a list that is lost: an earlier version stored no more than its hash
    if new or newest is None or any(newest.lacks(one) for one in known):
        entries = {entry.serial_number: entry for entry in (*revocation.merged(known), *new)}
        text = revocation.made(ca, ca_key, list(entries.values()), newest.number + 1 if newest else 0)
        newest = revocation.parsed(text, str(office / revocation.FILE), ca)
    for place in places:
        if not (place / revocation.FILE).exists() or revocation.read_list(place / revocation.FILE, ca) != newest:
            write_atomic(place / revocation.FILE, newest.text.encode())
    return newest


def change_passphrase(home: Path, office: Path, who: str, old: str, new: str) -> Path:
    """Encrypt a person's key, or the authority's (`authority`), with another passphrase and return its file. Raises
    KeysError, OSError."""
    keys.check_passphrase(new)
    if who == "authority":
        box = office / f"{CA}.key.pem"
    else:
        path = _path_of(home, who)
        box = path.with_name(f"{path.stem}.key.pem")
    key = keys.unlocked(box, old)
    write_atomic(box, encrypted_key.lock(key, new), 0o600)
    if who == "authority":
        (office / keys.AUTHORITY_PASSPHRASE).unlink(missing_ok=True)
    return box


def _known(office: Path) -> Iterator[x509.Certificate]:
    home = office.parent
    paths = [
        *sorted((office / ISSUED).glob("*.pem")),
        *(keys.person_files(home) if office == keys.folder(home) else []),
        *(keys.folder(home).glob(f"{BENCH}.pem") if office == keys.folder(home) else []),
    ]
    seen = {c.serial_number: c for c in map(keys.certificate_of, paths)}
    yield from seen.values()


def _path_of(home: Path, who: str) -> Path:
    own = keys.folder(home).glob(f"{BENCH}.pem")
    found = [path for path in (*keys.person_files(home), *own) if _is(keys.certificate_of(path), who)]
    if len(found) != 1:
        raise KeysError(f"{keys.folder(home)}: {len(found)} keys here are those of '{who}'; `accept keys list`")
    return found[0]


def _is(certificate: x509.Certificate, who: str) -> bool:
    """Return whether a certificate is the one meant: by name, by role if it stands for one person, or by sha256."""
    digest = len(who) >= 8 and authority.fingerprint(certificate).startswith(who.lower())
    return digest or same_person(authority.person_of(certificate), who) or authority.role_of(certificate) == who


def _put(path: Path, certificate: x509.Certificate) -> Path:
    write_atomic(path, certificate.public_bytes(Encoding.PEM))
    return path


def _one(asked: x509.CertificateSigningRequest, oid: x509.ObjectIdentifier) -> str:
    found = asked.subject.get_attributes_for_oid(oid)
    if len(found) != 1:
        raise KeysError("the request does not name one person in one role")
    return str(found[0].value)
