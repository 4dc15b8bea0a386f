"""Signed model files: a cell may load those alone that its own key has signed.

The signature of `NAME.hmcs` is a file `NAME.hmcs.sig` beside it: Ed25519 over the file's bytes. A
checksum tells damage; only a signature tells whose model it is. Needs the extra `hmcs[signing]`.
"""

from __future__ import annotations

import base64
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hmcs.bounded_files import UnreadableFileError, read_bounded
from hmcs.errors import UserError
from hmcs.recognition.model_archive import MOST_BYTES
from hmcs.whole_files import written_whole

_INSTALL = "install the extra hmcs[signing]: it brings cryptography"


class SignatureError(UserError):
    """A model that is not signed as it has to be."""


def signature_path(model: Path) -> Path:
    """Return where the signature of a model file is."""
    return model.with_name(f"{model.name}.sig")


def sign_model(model: Path, private_key: Path) -> Path:
    """Sign a model file with a private key (PEM); return the file of the signature.

    Raises SignatureError where either cannot be read, or the key is none of Ed25519.
    """
    serialization, ed25519 = _library()
    key = serialization.load_pem_private_key(_read(private_key), password=None)
    if not isinstance(key, ed25519.Ed25519PrivateKey):
        raise SignatureError(f"{private_key}: is no Ed25519 key")
    target = signature_path(model)
    with written_whole(target) as unfinished:
        unfinished.write_bytes(base64.b64encode(key.sign(_read(model))) + b"\n")
    return target


def signed_by(public_key: Path | None) -> Callable[[Path, bytes], None] | None:
    """Return what `load_model` is to verify; None where no key (PEM) is required.

    It raises SignatureError for a missing or wrong signature.
    """
    if public_key is None:
        return None
    return lambda path, data: _check(path, data, public_key)


def _check(path: Path, data: bytes, public_key: Path) -> None:
    serialization, ed25519 = _library()
    try:
        key = serialization.load_pem_public_key(_read(public_key))
    except ValueError as error:
        raise SignatureError(f"{public_key}: is no public key") from error
    if not isinstance(key, ed25519.Ed25519PublicKey):
        raise SignatureError(f"{public_key}: is no Ed25519 key")
    signature = signature_path(path)
    if not signature.exists():
        raise SignatureError(
            f"{path}: is not signed ({signature.name} is missing), and this cell loads signed "
            "models alone: `hmcs secure sign`"
        )
    try:
        key.verify(base64.b64decode(_read(signature), validate=False), data)
    except Exception as error:
        # Whatever is wrong with a signature, the model is not to be trusted.
        raise SignatureError(
            f"{path}: its signature is not of this cell's key, or the file was changed since: "
            "have it signed again by `hmcs secure sign`"
        ) from error


def _read(path: Path) -> bytes:
    try:
        return read_bounded(path, MOST_BYTES)
    except UnreadableFileError as error:
        raise SignatureError(str(error)) from error


def _library() -> tuple[Any, Any]:
    try:
        from cryptography.hazmat.primitives import serialization
        from cryptography.hazmat.primitives.asymmetric import ed25519
    except ImportError as error:
        raise SignatureError(
            f"models are to be signed, but cryptography is missing: {_INSTALL}"
        ) from error
    return serialization, ed25519
