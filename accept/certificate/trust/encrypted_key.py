"""Private keys at rest: PKCS#8, encrypted under a passphrase (PBES2: PBKDF2-HMAC-SHA256, AES-256-CBC; [RFC8018])."""

import os

from asn1crypto import algos, keys, pem
from cryptography.hazmat.primitives import hashes, padding, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.ciphers import Cipher, algorithms, modes
from cryptography.hazmat.primitives.kdf.pbkdf2 import PBKDF2HMAC

from specs.errors import AcceptError

# The figure of [OWASP-STORAGE] for PBKDF2-HMAC-SHA256, a tenth of a second here. The library's own PKCS#8 writer takes
# 2048, and its PKCS#12 writer leaves the MAC, a second way to try passphrases, at 2048.
ITERATIONS = 600_000


class LockedError(AcceptError, ValueError):
    """A private key that does not open: wrong passphrase or damaged file."""


def lock(key: ec.EllipticCurvePrivateKey, passphrase: str) -> bytes:
    """Return the encrypted key as PEM. Any PKCS#8 reader opens it, e.g. `openssl pkey`."""
    plain = key.private_bytes(
        serialization.Encoding.DER, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    salt, vector = os.urandom(16), os.urandom(16)
    derived = PBKDF2HMAC(hashes.SHA256(), 32, salt, ITERATIONS).derive(passphrase.encode("utf-8"))
    padder = padding.PKCS7(128).padder()
    encryptor = Cipher(algorithms.AES(derived), modes.CBC(vector)).encryptor()
    hidden = encryptor.update(padder.update(plain) + padder.finalize()) + encryptor.finalize()
    box = keys.EncryptedPrivateKeyInfo({"encryption_algorithm": _algorithm(salt, vector), "encrypted_data": hidden})
    armoured: bytes = pem.armor("ENCRYPTED PRIVATE KEY", box.dump())
    return armoured


def unlock(box: bytes, passphrase: str) -> ec.EllipticCurvePrivateKey:
    """Return the private key. Raises LockedError."""
    try:
        key = serialization.load_pem_private_key(box, passphrase.encode("utf-8"))
    except (ValueError, TypeError) as e:
        raise LockedError("does not open: wrong passphrase, or the file is damaged") from e
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise LockedError("is not an elliptic-curve key")
    return key


def _algorithm(salt: bytes, vector: bytes) -> dict[str, object]:
    derivation = {
        "salt": algos.Pbkdf2Salt("specified", salt),
        "iteration_count": ITERATIONS,
        "prf": {"algorithm": "sha256"},
    }
    return {
        "algorithm": "pbes2",
        "parameters": {
            "key_derivation_func": {"algorithm": "pbkdf2", "parameters": derivation},
            "encryption_scheme": {"algorithm": "aes256_cbc", "parameters": vector},
        },
    }
