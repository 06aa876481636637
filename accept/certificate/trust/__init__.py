"""Trust: the keys of a bench, the authority that certifies them, and what they have signed beside certificates.

    init(home, "correct horse", "Ann")  # the authority, the technician's key, the certificate of the bench itself
    credential = unlock(home, TECHNICIAN, "correct horse")  # KeysError says what is wrong, LockedError if it stays shut
    credential.person, credential.ca  # who signs, and the authority that says so
    persons(home, QA)  # quality assurance has no key yet: the authority certifies one that she requests
    opens_a_key(home, "a serial")  # True for what must not be stored in clear

    bench_statement(bench, spec.checks, day, home, {})  # calibrations, and which instruments are commissioned
    approved_at(store, spec, home)  # when quality assurance approved it, and by which event

Keys are requested, issued, renewed and revoked by `accept keys`; its commands read the files behind this door."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from accept.certificate.trust.authority import QA, TECHNICIAN
    from accept.certificate.trust.commissioning import WITHOUT_WIRE, bench_statement, write_commissioning
    from accept.certificate.trust.encrypted_key import LockedError
    from accept.certificate.trust.keys import (
        AUTHORITY_PASSPHRASE,
        SHORTEST_PASSPHRASE,
        Credential,
        KeysError,
        check_passphrase,
        exist,
        init,
        list_file,
        opens_a_key,
        persons,
        stamping,
        unlock,
    )
    from accept.certificate.trust.spec_approval import approved_at
else:
    __getattr__ = door(__name__)
