"""HTTP answers of the page's door, and the request it makes of the page's own server."""

from __future__ import annotations

import base64
import binascii
import re
from collections.abc import Iterable
from http import HTTPStatus

import viser

from hmcs_console.seeing.reports import HEADERS
from hmcs_console.serving.admission import Head
from hmcs_console.serving.document import Document

_PROTOCOL = f"viser-v{viser.__version__}"
_KEY = re.compile(r"[A-Za-z0-9+/]{22}==")
_SAFE = (
    "X-Content-Type-Options: nosniff",
    "X-Frame-Options: DENY",
    "Referrer-Policy: no-referrer",
    "Cross-Origin-Resource-Policy: same-origin",
    "Connection: close",
)


def answer(
    status: int, reason: str = "", headers: Iterable[str] = (), body: bytes | None = None
) -> bytes:
    """Return a whole HTTP answer, which says `reason` where it has no body."""
    fields = [*headers, *_SAFE]
    if body is None:
        fields.append("Content-Type: text/plain; charset=utf-8")
        body = f"{reason}\n".encode()
    fields.append(f"Content-Length: {len(body)}")
    head = "\r\n".join([f"HTTP/1.1 {status} {HTTPStatus(status).phrase}", *fields])
    return head.encode("latin-1") + b"\r\n\r\n" + body


def document_for(head: Head, document: Document) -> bytes:
    """Return the answer to a request for a document: the page, or that it is none."""
    if head.method != "GET":
        return answer(405, "this page is only looked at", ["Allow: GET"])
    if head.path not in ("/", "/index.html"):
        return answer(404, "there is nothing but the page, and the reports of its models")
    if "gzip" not in head.headers.get("accept-encoding", ""):
        return answer(200, headers=document.headers, body=document.body)
    headers = [*document.headers, "Content-Encoding: gzip"]
    return answer(200, headers=headers, body=document.zipped)


def report_for(report: bytes | None) -> bytes:
    """Return the answer to a request for the report of a training; None where there is none."""
    if report is None:
        return answer(404, "no model in the console's folders has a report of that name")
    return answer(200, headers=HEADERS, body=report)


def asks_for_socket(head: Head) -> bool:
    """Whether a request wants to become a WebSocket."""
    return head.headers.get("upgrade", "").lower() == "websocket"


def wrong_with_socket(head: Head) -> str:
    """Return why a request cannot become one, in words; empty where it can."""
    connection = head.headers.get("connection", "").lower()
    if head.method != "GET" or "upgrade" not in re.split(r"[\s,]+", connection):
        return "this is no request for a WebSocket"
    if head.headers.get("sec-websocket-version") != "13" or not _is_key(
        head.headers.get("sec-websocket-key", "")
    ):
        return "this is no request for a WebSocket of version 13"
    protocols = re.split(r"[\s,]+", head.headers.get("sec-websocket-protocol", ""))
    return "" if _PROTOCOL in protocols else "this page is of another version: load it anew"


def request_for_socket(head: Head, port: int) -> bytes:
    """Return the request to the page's own server at a loopback port, made anew."""
    lines = (
        "GET / HTTP/1.1",
        f"Host: 127.0.0.1:{port}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        f"Sec-WebSocket-Key: {head.headers['sec-websocket-key']}",
        "Sec-WebSocket-Version: 13",
        f"Sec-WebSocket-Protocol: {_PROTOCOL}",
    )
    return "\r\n".join([*lines, "", ""]).encode()


def _is_key(key: str) -> bool:
    if not _KEY.fullmatch(key):
        return False
    try:
        return len(base64.b64decode(key, validate=True)) == 16
    except binascii.Error:
        return False
