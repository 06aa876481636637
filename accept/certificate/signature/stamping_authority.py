"""Questions to a time stamping authority when a signature is made: a token ([RFC3161]) and the revocation data of its
certificates. Verification needs no server."""

import asyncio
import time
from collections.abc import Sequence
from datetime import UTC, datetime

from asn1crypto import cms, tsp
from cryptography import x509
from pyhanko.sign.timestamps import TimeStamper
from pyhanko.sign.timestamps.common_utils import TimestampRequestError, set_tsp_headers
from pyhanko_certvalidator import ValidationContext
from pyhanko_certvalidator.errors import PathError, RevokedError, ValidationError

from accept.certificate.signature.long_term import RevocationData, loaded
from accept.certificate.signature.timestamp import LARGEST, status_of
from accept.certificate.trust.revocation import CLOCK_SLACK
from specs.errors import AcceptError

TIMEOUT_S = 20.0  # for one answer of a time stamping authority
ALL_S = 60.0  # for all of the authority's servers together
FRESH_S = 600.0  # a batch asks once for all that it signs in this time


class AuthorityRevoked(AcceptError, ValueError):
    """The time stamping authority's certificate is revoked: what it stamps proves nothing."""


class _Client(TimeStamper):
    """Client of the authority at a URL. It waits TIMEOUT_S for an answer, reads no more than LARGEST bytes of it, and
    refuses a timestamp that would not verify."""

    def __init__(self, url: str) -> None:
        super().__init__()  # type: ignore[no-untyped-call]  # pyhanko leaves it untyped
        self.url = url

    async def async_timestamp(self, message_digest: bytes, md_algorithm: str) -> cms.ContentInfo:
        """Return the token of a digest. Raises TimestampRequestError."""
        try:
            token = await super().async_timestamp(message_digest, md_algorithm)
            signed = token["content"]
            moment: datetime = signed["encap_content_info"]["content"].parsed["gen_time"].native
            status = await status_of(signed, lambda _: message_digest, (), moment)
        except TimestampRequestError:
            raise
        except Exception as e:  # a parser of what a server sent fails in any way
            raise TimestampRequestError(f"its answer is no timestamp ({type(e).__name__}: {e})") from e
        if not (status["intact"] and status["valid"]):
            raise TimestampRequestError("its timestamp is of another signature, or damaged")
        if abs(moment - (now := datetime.now(UTC))) > CLOCK_SLACK:
            raise TimestampRequestError(
                f"its timestamp says {moment:%Y-%m-%d %H:%M} UTC, here it is {now:%Y-%m-%d %H:%M}"
            )
        return token

    async def async_request_tsa_response(self, req: tsp.TimeStampReq) -> tsp.TimeStampResp:
        """Return the answer of the server. Raises TimestampRequestError, ValueError."""
        from accept.certificate.signature.servers import ServerError, fetch  # loads requests

        try:
            answer = await fetch("POST", self.url, TIMEOUT_S, LARGEST, data=req.dump(), headers=set_tsp_headers({}))
        except ServerError as e:
            raise TimestampRequestError(str(e)) from e
        except Exception as e:  # whose own words repeat the address, with its secrets
            raise TimestampRequestError(f"it cannot be reached ({type(e).__name__})") from e
        if answer.headers.get("Content-Type") != "application/timestamp-reply":
            raise TimestampRequestError(f"it answered {answer.status_code}, and no timestamp")
        return tsp.TimeStampResp.load(answer.content)


def stamper(url: str) -> TimeStamper:
    """Return the client of the authority at a URL. It raises TimestampRequestError."""
    return _Client(url)


_asked: dict[str, tuple[float, RevocationData]] = {}


async def revocation_data(stamping: TimeStamper, roots: Sequence[x509.Certificate]) -> RevocationData:
    """Ask the servers that the authority's certificates name. roots: of authorities that are known here. The roots that
    come with a token count too, because nothing is trusted by this: a verifier names its own.

    Raises AuthorityRevoked, TimestampRequestError, OSError."""
    place = str(getattr(stamping, "url", ""))
    when, found = _asked.get(place, (0.0, None))
    if found is None or not place or time.monotonic() - when > FRESH_S:
        found = await _ask(stamping, roots)
        _asked[place] = time.monotonic(), found
    return found


async def _ask(stamping: TimeStamper, roots: Sequence[x509.Certificate]) -> RevocationData:
    from accept.certificate.signature.servers import BoundedBackend  # loads requests

    token = await stamping.async_dummy_response("sha256")
    carried = [choice.chosen for choice in token["content"]["certificates"]]
    context = ValidationContext(
        trust_roots=[*loaded(roots), *(c for c in carried if c.self_issued)],
        other_certs=carried,
        allow_fetching=True,
        fetcher_backend=BoundedBackend(),
    )
    try:
        found = stamping.validation_paths(context)  # type: ignore[no-untyped-call]  # pyhanko leaves it untyped
        async with asyncio.timeout(ALL_S):
            chains = [list(path) async for path in found]
    except RevokedError as e:
        raise AuthorityRevoked(f"the time stamping authority's certificate is revoked: {e}") from e
    except (PathError, ValidationError, TimeoutError):
        return RevocationData()  # no answer; or its root is not known here: whose answers they would be cannot be said
    return RevocationData([c for chain in chains for c in chain], context.crls, context.ocsps)
