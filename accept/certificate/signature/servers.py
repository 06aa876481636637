"""Questions to the servers of a time stamping authority: whatever they answer, none holds a bench up or fills its
memory."""

import asyncio
import time
from collections.abc import Sequence
from threading import Thread
from typing import Any

import requests
from pyhanko_certvalidator.fetchers.api import Fetchers, FetchLimits
from pyhanko_certvalidator.fetchers.common_utils import FetchBudget
from pyhanko_certvalidator.fetchers.requests_fetchers import RequestsFetcherBackend
from pyhanko_certvalidator.fetchers.requests_fetchers.cert_fetch_client import RequestsCertificateFetcher
from pyhanko_certvalidator.fetchers.requests_fetchers.crl_client import RequestsCRLFetcher
from pyhanko_certvalidator.fetchers.requests_fetchers.ocsp_client import RequestsOCSPFetcher

ANSWER_S = 10.0  # for each of the servers that the authority's certificates name
LARGEST = 5_000_000  # bytes of such an answer: the lists of large authorities have some 1e6
MOST = 20  # questions; an authority's chain needs two or three


class ServerError(ValueError):
    """A server whose answer has no end."""


async def fetch(method: str, url: str, within_s: float, largest: int, **more: Any) -> requests.Response:
    """Return a server's answer with its content. Raises ServerError, requests.RequestException."""
    found = list[requests.Response | Exception]()
    Thread(target=_fetch, args=(found, method, url, within_s, largest, more), daemon=True).start()
    until = time.monotonic() + within_s
    while not found:  # a thread that hangs holds nothing up
        if time.monotonic() > until:
            raise ServerError(f"no answer within {within_s:g} s")
        await asyncio.sleep(0.005)
    if isinstance(found[0], Exception):
        raise found[0]
    return found[0]


def _fetch(
    found: list[requests.Response | Exception], method: str, url: str, within_s: float, largest: int, more: Any
) -> None:
    try:
        with requests.request(method, url, timeout=within_s, stream=True, **more) as answer:
            content = b""
            for piece in answer.iter_content(65536):
                content += piece
                if len(content) > largest:
                    raise ServerError(f"its answer has more than {largest} bytes")
            answer._content = content  # noqa: SLF001 - as `content` keeps what it read
        found.append(answer)
    except Exception as e:  # noqa: BLE001 - raised by who waits for it
        found.append(e)


class _Bounded:
    """What the fetchers ask by."""

    async def _get(self, url: str, *, acceptable_content_types: Sequence[str]) -> requests.Response:
        return await _ok("GET", url, {"Accept": ",".join(acceptable_content_types)})

    async def _post(
        self, url: str, data: bytes, *, content_type: str, acceptable_content_types: Sequence[str]
    ) -> requests.Response:
        headers = {"Accept": ",".join(acceptable_content_types), "Content-Type": content_type}
        return await _ok("POST", url, headers, data)


async def _ok(method: str, url: str, headers: dict[str, str], data: bytes | None = None) -> requests.Response:
    answer = await fetch(method, url, ANSWER_S, LARGEST, headers=headers, data=data)
    if answer.status_code != 200:
        raise ServerError(f"it answered {answer.status_code}")
    return answer


class _Certificates(_Bounded, RequestsCertificateFetcher): ...


class _Lists(_Bounded, RequestsCRLFetcher): ...


class _Answers(_Bounded, RequestsOCSPFetcher): ...


class BoundedBackend(RequestsFetcherBackend):
    """Asks the servers that certificates name, at most `MOST` times."""

    def get_fetchers(self) -> Fetchers:
        """Return the fetchers of one validation."""
        budget = FetchBudget(FetchLimits(max_requests=MOST))
        lists = _Lists(budget=budget)  # type: ignore[no-untyped-call]  # pyhanko leaves it untyped
        return Fetchers(_Answers(budget=budget), lists, _Certificates(budget=budget))
