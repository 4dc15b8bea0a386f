"""A cell's own certificate authority, as files that only their owner can read.

FOLDER/ca.pem, ca.key               the authority
FOLDER/models.pub, models.key       what models are signed with
FOLDER/holders/ROLE[@INSTANCE].pem, .key
"""

from __future__ import annotations

import ipaddress
import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec, ed25519
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from hmcs.errors import UserError
from hmcs.whole_files import written_whole
from hmcs_secure.identity import ROUTER, Identity

AUTHORITY_DAYS = 3650
HOLDER_DAYS = 365
_SKEW = timedelta(minutes=5)
"""Hosts whose clocks are so far behind take a certificate that was issued just now."""
LOOPBACK = ("localhost", "127.0.0.1", "::1")
"""Names every router has besides those it is given."""

Key = ec.EllipticCurvePrivateKey | ed25519.Ed25519PrivateKey


class AuthorityError(UserError):
    """Files of a cell's authority that are missing, taken or no such files."""


@dataclass(frozen=True)
class Holder:
    """A certificate that was issued, and until when it is valid."""

    identity: Identity
    certificate: Path
    key: Path
    valid_until: datetime
    hosts: tuple[str, ...]
    """Names and addresses a router may be reached by; empty for all others."""

    def days_left(self, now: datetime) -> int:
        """Return whole days until it expires; negative once it has."""
        return (self.valid_until - now).days


@dataclass(frozen=True)
class Authority:
    """The certificate authority of one cell."""

    folder: Path
    cell: str
    valid_until: datetime

    @property
    def certificate(self) -> Path:
        """Its certificate, for everybody of the cell to check others by."""
        return self.folder / "ca.pem"

    @property
    def model_key(self) -> Path:
        """The public key that signed models are checked with."""
        return self.folder / "models.pub"

    @property
    def model_signing_key(self) -> Path:
        """The private key that models are signed with."""
        return self.folder / "models.key"


def create_authority(folder: Path, cell: str, now: datetime) -> Authority:
    """Make the authority of a cell in a new or empty folder.

    Raises AuthorityError where there is one already.
    """
    if (folder / "ca.pem").exists() or (folder / "ca.key").exists():
        raise AuthorityError(
            f"{folder}: holds an authority already: use it, or remove it with all its certificates"
        )
    folder.mkdir(parents=True, exist_ok=True)
    folder.chmod(0o700)
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"{cell}/authority")])
    certificate = (
        _builder(name, name, key.public_key(), now, AUTHORITY_DAYS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs_certificates=True), critical=True)
        .sign(key, hashes.SHA256())
    )
    signing = ed25519.Ed25519PrivateKey.generate()
    _write_key(folder / "ca.key", key)
    _write_key(folder / "models.key", signing)
    _write(
        folder / "models.pub",
        signing.public_key().public_bytes(
            serialization.Encoding.PEM, serialization.PublicFormat.SubjectPublicKeyInfo
        ),
    )
    _write(folder / "ca.pem", certificate.public_bytes(serialization.Encoding.PEM))
    return Authority(folder, cell, certificate.not_valid_after_utc)


def open_authority(folder: Path) -> Authority:
    """Return the authority in a folder. Raises AuthorityError where there is none."""
    certificate = _read_certificate(folder / "ca.pem", "make one with `hmcs secure init`")
    common_name = _common_name(certificate)
    cell, _, what = common_name.partition("/")
    if what != "authority":
        raise AuthorityError(f"{folder}/ca.pem: is of {common_name!r}, no authority of a cell")
    return Authority(folder, cell, certificate.not_valid_after_utc)


def issue(
    authority: Authority,
    identity: Identity,
    now: datetime,
    *,
    hosts: Sequence[str] = (),
    days: int = HOLDER_DAYS,
) -> Holder:
    """Issue a certificate, in place of an earlier one of the same holder.

    `hosts` are the names and addresses a router is reached by, besides those of this machine
    itself. Raises AuthorityError where the authority's key is missing or expired.
    """
    if authority.valid_until <= now:
        raise AuthorityError(
            f"{authority.certificate}: has expired on {authority.valid_until:%Y-%m-%d}: make a new "
            "authority and issue all certificates anew"
        )
    parent = _read_key(authority.folder / "ca.key")
    issuer = _read_certificate(authority.certificate, "").subject
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, identity.common_name)])
    named = tuple(dict.fromkeys([*LOOPBACK, *hosts])) if identity.role == ROUTER else tuple(hosts)
    builder = (
        _builder(name, issuer, key.public_key(), now, days)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs_certificates=False), critical=True)
        .add_extension(
            x509.ExtendedKeyUsage(
                [ExtendedKeyUsageOID.CLIENT_AUTH, ExtendedKeyUsageOID.SERVER_AUTH]
                if identity.role == ROUTER
                else [ExtendedKeyUsageOID.CLIENT_AUTH]
            ),
            critical=False,
        )
    )
    if named:
        alternatives = x509.SubjectAlternativeName([_alternative(host) for host in named])
        builder = builder.add_extension(alternatives, critical=False)
    certificate = builder.sign(parent, hashes.SHA256())
    holders = authority.folder / "holders"
    holders.mkdir(exist_ok=True)
    holders.chmod(0o700)
    file = holders / f"{identity.file_name}.pem"
    _write_key(file.with_suffix(".key"), key)
    _write(file, certificate.public_bytes(serialization.Encoding.PEM))
    return Holder(identity, file, file.with_suffix(".key"), certificate.not_valid_after_utc, named)


def holders_of(authority: Authority) -> list[Holder]:
    """Return every certificate that was issued, by file name.

    Raises AuthorityError for a file among them that is none of this cell.
    """
    found = []
    for file in sorted((authority.folder / "holders").glob("*.pem")):
        certificate = _read_certificate(file, "issue it anew")
        identity = Identity.of_common_name(_common_name(certificate))
        if identity.cell != authority.cell:
            raise AuthorityError(f"{file}: is of cell {identity.cell!r}, not {authority.cell!r}")
        found.append(
            Holder(
                identity,
                file,
                file.with_suffix(".key"),
                certificate.not_valid_after_utc,
                _hosts(certificate),
            )
        )
    return found


def readable_by_others(path: Path) -> bool:
    """Whether anybody but its owner may read a file."""
    return bool(path.stat().st_mode & 0o077)


def utc_now() -> datetime:
    """Return the time now, UTC."""
    return datetime.now(UTC)


def _builder(
    subject: x509.Name,
    issuer: x509.Name,
    key: ec.EllipticCurvePublicKey,
    now: datetime,
    days: int,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _SKEW)
        .not_valid_after(now + timedelta(days=days))
    )


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        encipher_only=False,
        decipher_only=False,
    )


def _alternative(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        pass
    try:
        return x509.DNSName(host)
    except ValueError as error:
        raise AuthorityError(f"host {host!r} is no name or address: {error}") from error


def _hosts(certificate: x509.Certificate) -> tuple[str, ...]:
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return ()
    return tuple(str(name.value) for name in names)


def _common_name(certificate: x509.Certificate) -> str:
    names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(names[0].value) if names else ""


def _read_certificate(path: Path, advice: str) -> x509.Certificate:
    try:
        return x509.load_pem_x509_certificate(path.read_bytes())
    except OSError as error:
        raise AuthorityError(f"{path}: {error.strerror}: {advice}") from error
    except ValueError as error:
        raise AuthorityError(f"{path}: is no certificate: {advice}") from error


def _read_key(path: Path) -> ec.EllipticCurvePrivateKey:
    try:
        key = serialization.load_pem_private_key(path.read_bytes(), password=None)
    except OSError as error:
        raise AuthorityError(
            f"{path}: {error.strerror}: certificates are issued where the authority's key is kept"
        ) from error
    except (ValueError, TypeError) as error:
        raise AuthorityError(f"{path}: is no private key without a password") from error
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise AuthorityError(f"{path}: is no key of an elliptic curve")
    return key


def _write_key(path: Path, key: Key) -> None:
    data = key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    with written_whole(path) as unfinished:
        # Never readable by others, not for a moment.
        descriptor = os.open(unfinished, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        os.write(descriptor, data)
        os.close(descriptor)


def _write(path: Path, data: bytes) -> None:
    with written_whole(path) as unfinished:
        unfinished.write_bytes(data)
