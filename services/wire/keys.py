"""Makes the certificates of the secure profile: one authority a robot, one key a role and host."""

from __future__ import annotations

import datetime
import ipaddress
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from services.wire.access import PEOPLE, common_name

PEOPLE_FOLDER = "people"
BACKDATE = datetime.timedelta(days=1)  # hosts need not agree on the time better than this
_YEARS = datetime.timedelta(days=3650)


@dataclass(frozen=True)
class Authority:
    """Who signs. Its key belongs on no robot."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    def pem(self) -> bytes:
        """The certificate that everybody is given."""
        return self.certificate.public_bytes(serialization.Encoding.PEM)


def new_authority(robot: str) -> Authority:
    """A new authority for a robot (P-256, ten years)."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"authority of {robot}")])
    now = datetime.datetime.now(datetime.UTC)
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - BACKDATE)
        .not_valid_after(now + _YEARS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs_others=True), critical=True)
        .sign(key, hashes.SHA256())
    )
    return Authority(certificate, key)


def issue(
    authority: Authority,
    folder: Path,
    robot: str,
    role: str,
    address: str | None = None,
    days: float = 365,
) -> None:
    """Write ``<role>.pem``, ``<role>.key`` and ``authority.pem`` into a folder.

    Args:
        authority: who signs.
        folder: of one host, or of one group of people; made if it is not there.
        robot: name of the robot.
        role: one of ``access.ROLES``.
        address: IP address or name others connect to; None for who only connects.
        days: how long it is valid; negative makes one that has expired.
    """
    key = ec.generate_private_key(ec.SECP256R1())
    cn = common_name(robot, role)
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, cn)])
    end = datetime.datetime.now(datetime.UTC) + datetime.timedelta(days=days)
    uses = [ExtendedKeyUsageOID.CLIENT_AUTH, ExtendedKeyUsageOID.SERVER_AUTH]
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(authority.certificate.subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(min(end, datetime.datetime.now(datetime.UTC)) - BACKDATE)
        .not_valid_after(end)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs_others=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage(uses), critical=False)
        .add_extension(x509.SubjectAlternativeName([_alternative(address or cn)]), critical=False)
        .sign(authority.key, hashes.SHA256())
    )
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    _write(folder / "authority.pem", authority.pem())
    _write(folder / f"{role}.pem", certificate.public_bytes(serialization.Encoding.PEM))
    _write(folder / f"{role}.key", _private(key), secret=True)


def make_keys(
    folder: Path, robot: str, hosts: Mapping[str, tuple[str, Iterable[str]]], days: float = 365
) -> list[Path]:
    """Everything a robot needs: a folder for each host, one for people, the authority beside them.

    An authority that is there already signs again: keys are renewed, nobody has to be told.

    Args:
        folder: where to; ``authority.key`` in it belongs on no robot.
        robot: name of the robot.
        hosts: name of a host to its address and services.
        days: how long the certificates are valid.

    Returns:
        The folders, each to be copied to its host.
    """
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    authority = load_authority(folder) or _kept(new_authority(robot), folder)
    for host, (address, services) in hosts.items():
        for service in services:
            issue(authority, folder / host, robot, service, address, days)
    for role in PEOPLE:
        issue(authority, folder / PEOPLE_FOLDER, robot, role, None, days)
    return [folder / name for name in (*hosts, PEOPLE_FOLDER)]


def load_authority(folder: Path) -> Authority | None:
    """The authority kept in a folder, None if there is none.

    Raises:
        ValueError: its files cannot be read as a certificate and its key.
    """
    key_file, file = folder / "authority.key", folder / "authority.pem"
    if not key_file.exists():
        return None
    key = serialization.load_pem_private_key(key_file.read_bytes(), None)
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise ValueError(f"{key_file} is not a key of the kind made by steadyhand keys")
    return Authority(x509.load_pem_x509_certificate(file.read_bytes()), key)


def _kept(authority: Authority, folder: Path) -> Authority:
    _write(folder / "authority.pem", authority.pem())
    _write(folder / "authority.key", _private(authority.key), secret=True)
    return authority


def _private(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )


def _write(path: Path, content: bytes, secret: bool = False) -> None:
    """A new file: a secret one is never readable by others, not even while it is written."""
    path.unlink(missing_ok=True)
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600 if secret else 0o644)
    with os.fdopen(handle, "wb") as file:
        file.write(content)


def _alternative(address: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(address))
    except ValueError:
        return x509.DNSName(address)


def _usage(signs_others: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_others,
        key_cert_sign=signs_others,
        crl_sign=signs_others,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )
