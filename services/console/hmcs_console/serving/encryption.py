"""How connections to the page are encrypted."""

from __future__ import annotations

import ssl
from pathlib import Path

from hmcs.errors import UserError


def encryption(certificate: Path, key: Path) -> ssl.SSLContext:
    """Return how connections are encrypted, by files of a certificate and of its key.

    Raises UserError where one of them cannot be used.
    """

    def no_password() -> str:
        raise UserError(f"the key in {key} asks for a password: give one without")

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_cert_chain(certificate, key, password=no_password)
    except (OSError, ssl.SSLError) as error:
        raise UserError(
            f"the page cannot be served with certificate {certificate} and key {key}: "
            f"{error.strerror or error}: give PEM files of a certificate and its key"
        ) from error
    return context
