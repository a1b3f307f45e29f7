"""The platform's TLS: a certificate that somebody gave us, or one of our own making that robots are given to trust.

Needed for every address but loopback: what robots send carries their tokens. No trust in packages rests on it.
"""

import ipaddress
import ssl
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, generate_private_key
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from cryptography.x509.oid import NameOID

from rapp_cloud.files import write_whole
from rapp_hop.errors import Invalid, Refused

CERTIFICATE, KEY = "certificate.pem", "key.pem"
WARNING = 14 * 86400.0  # seconds before its end at which a certificate should be renewed
_LASTS = timedelta(days=3650)


def is_loopback(address: str) -> bool:
    """Tell whether an address to listen on is reached from this computer only."""
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return address == "localhost"


def is_here(address: str, headers: Mapping[str, str]) -> bool:
    """Tell whether a request comes from a program on this computer, which no proxy here has passed on."""
    return is_loopback(address) and not any("forwarded" in name for name in headers)


def make_certificate(folder: Path, hosts: Sequence[str]) -> Path:
    """Make a certificate for these names and addresses, signed by itself, and its key (0600); return the certificate's path.

    The key lies open: the server must read it unattended at each start.
    """
    key = generate_private_key(SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, hosts[0][:64])])
    now = datetime.now(UTC)
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(days=1))
        .not_valid_after(now + _LASTS)
        .add_extension(x509.SubjectAlternativeName([_name(host) for host in hosts]), critical=False)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .sign(key, SHA256())
    )
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    secret = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    write_whole(folder / KEY, secret, mode=0o600)
    write_whole(folder / CERTIFICATE, certificate.public_bytes(Encoding.PEM))
    return folder / CERTIFICATE


def validity(certificate: Path) -> tuple[float, float]:
    """Return since when and until when a certificate is good, in seconds since 1970 (UTC).

    :raises Refused: when it cannot be read
    :raises Invalid: when it is none
    """
    found = _read(certificate)
    return found.not_valid_before_utc.timestamp(), found.not_valid_after_utc.timestamp()


def may_be_made_anew(certificate: Path) -> bool:
    """Tell whether a certificate is one of our own making, and at its end."""
    found = _read(certificate)
    ends = found.not_valid_after_utc.timestamp() - datetime.now(UTC).timestamp() < WARNING
    return ends and found.issuer == found.subject


def server_tls(certificate: Path, key: Path) -> ssl.SSLContext:
    """Return what to speak TLS with.

    :raises Refused: when a file cannot be read, or others can read the key
    :raises Invalid: when the two do not belong together
    """
    try:
        if key.stat().st_mode & 0o077:
            raise Refused(f"cannot use {key}: others can read it, set its mode to 0600")
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        context.load_cert_chain(certificate, key)
    except ssl.SSLError as error:
        raise Invalid(f"cannot use {certificate} with {key}: {error.reason}") from None
    except OSError as error:
        raise Refused(f"cannot use {certificate} with {key}: {error.strerror}, run rapp_cloud init --host NAME") from None
    return context


def _read(certificate: Path) -> x509.Certificate:
    try:
        return x509.load_pem_x509_certificate(certificate.read_bytes())
    except OSError as error:
        raise Refused(f"cannot read {certificate}: {error.strerror}") from None
    except ValueError:
        raise Invalid(f"cannot read {certificate}: it is no certificate in PEM form") from None


def _name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)
