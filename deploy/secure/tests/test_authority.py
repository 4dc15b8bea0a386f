"""Certificates say who holds them, keys are their owner's alone, and expiry is seen in time."""

from __future__ import annotations

import stat
from datetime import timedelta

import pytest
from cryptography import x509
from cryptography.x509.oid import NameOID

from hmcs.bus.keys import KeyNameError
from hmcs.bus.rights import roles
from hmcs_secure.authority import (
    AuthorityError,
    create_authority,
    holders_of,
    issue,
    open_authority,
    readable_by_others,
    utc_now,
)
from hmcs_secure.identity import ROUTER, Identity, IdentityError
from hmcs_secure.router_file import router_configuration, write_router_file


def common_name(path) -> str:
    certificate = x509.load_pem_x509_certificate(path.read_bytes())
    return str(certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value)


@pytest.mark.parametrize("role", [*roles(), ROUTER])
def test_a_common_name_says_cell_and_service(authority, role) -> None:
    holder = issue(authority("welding"), Identity("welding", role), utc_now())
    assert common_name(holder.certificate) == f"welding/{role}"
    assert Identity.of_common_name(f"welding/{role}") == Identity("welding", role)


def test_a_bound_common_name_says_the_instance_too(authority) -> None:
    identity = Identity("closed", "robot", "robot-1")
    holder = issue(authority(), identity, utc_now())
    assert common_name(holder.certificate) == "closed/robot/robot-1"
    assert holder.certificate.name == "robot@robot-1.pem"


@pytest.mark.parametrize(
    ("cell", "role", "instance"),
    [("closed", "roboter", ""), ("closed", "", ""), ("c" * 60, "robot", "r" * 20)],
)
def test_an_identity_that_cannot_be_is_refused(cell, role, instance) -> None:
    with pytest.raises(IdentityError):
        Identity(cell, role, instance)


@pytest.mark.parametrize("bad", ["a/b", "*", "..", "", "a b"])
def test_cells_and_instances_have_names_of_keys(bad) -> None:
    with pytest.raises(KeyNameError):
        Identity(bad, "robot")
    if bad:
        with pytest.raises(KeyNameError):
            Identity("closed", "robot", bad)


@pytest.mark.parametrize("name", ["x", "a/b/c/d", "closed/nobody"])
def test_a_common_name_of_another_form_names_nobody(name) -> None:
    with pytest.raises(IdentityError):
        Identity.of_common_name(name)


def test_private_keys_can_be_read_by_their_owner_alone(authority) -> None:
    made = authority()
    issue(made, Identity("closed", "robot"), utc_now())
    keys = list(made.folder.rglob("*.key"))
    assert len(keys) == 3
    assert not any(readable_by_others(key) for key in keys)
    assert stat.S_IMODE(made.folder.stat().st_mode) == 0o700


def test_a_second_authority_does_not_take_the_place_of_the_first(authority, tmp_path) -> None:
    authority()
    with pytest.raises(AuthorityError, match="holds an authority already"):
        create_authority(tmp_path / "closed", "closed", utc_now())


def test_what_was_issued_is_found_again_with_its_expiry(authority) -> None:
    made, now = authority(), utc_now()
    issue(made, Identity("closed", "robot"), now, days=20)
    router = issue(made, Identity("closed", ROUTER), now, hosts=["robots.lab", "10.0.0.7"])
    assert {"localhost", "127.0.0.1", "robots.lab", "10.0.0.7"} <= set(router.hosts)
    found = {holder.identity.role: holder for holder in holders_of(open_authority(made.folder))}
    assert set(found) == {"robot", ROUTER}
    assert found["robot"].days_left(now) in (19, 20)
    assert found["robot"].days_left(now + timedelta(days=25)) < 0
    assert found[ROUTER].hosts == router.hosts


def test_a_certificate_of_another_cell_among_ones_own_is_reported(authority, tmp_path) -> None:
    made = authority()
    other = create_authority(tmp_path / "other", "other", utc_now())
    stranger = issue(other, Identity("other", "robot"), utc_now())
    (made.folder / "holders").mkdir()
    (made.folder / "holders" / "robot.pem").write_bytes(stranger.certificate.read_bytes())
    with pytest.raises(AuthorityError, match="of cell 'other', not 'closed'"):
        holders_of(made)


@pytest.mark.parametrize("content", [b"", b"no certificate", b"\x00" * 1000])
def test_a_file_that_is_no_certificate_is_reported_with_what_to_do(authority, content) -> None:
    made = authority()
    made.certificate.write_bytes(content)
    with pytest.raises(AuthorityError, match="no certificate: make one"):
        open_authority(made.folder)


def test_without_the_authoritys_key_nothing_is_issued(authority) -> None:
    made = authority()
    (made.folder / "ca.key").unlink()
    with pytest.raises(AuthorityError, match="issued where the authority's key is kept"):
        issue(made, Identity("closed", "robot"), utc_now())


def test_an_expired_authority_issues_nothing(authority) -> None:
    made = authority(now=utc_now() - timedelta(days=4000))
    with pytest.raises(AuthorityError, match="has expired"):
        issue(made, Identity("closed", "robot"), utc_now())


def test_a_host_that_is_no_name_is_refused(authority) -> None:
    with pytest.raises(AuthorityError, match="is no name or address"):
        issue(authority(), Identity("closed", ROUTER), utc_now(), hosts=["bär.example"])


def test_a_router_without_a_certificate_is_refused_with_how_to_get_one(authority, tmp_path) -> None:
    with pytest.raises(AuthorityError, match="hmcs secure issue closed router"):
        write_router_file(authority(), tmp_path / "router.json5")


def test_a_router_denies_by_default_and_knows_every_certificate(authority) -> None:
    made, now = authority(), utc_now()
    holders = [issue(made, Identity("closed", role), now) for role in (*roles(), ROUTER)]
    made_of = router_configuration(made, holders[-1], holders)
    access = made_of["access_control"]
    assert access["enabled"]
    assert access["default_permission"] == "deny"
    assert all(rule["permission"] == "allow" for rule in access["rules"])
    names = [name for subject in access["subjects"] for name in subject["cert_common_names"]]
    assert sorted(names) == sorted(holder.identity.common_name for holder in holders)
    assert made_of["transport"]["link"]["tls"]["enable_mtls"]
    assert made_of["listen"]["endpoints"] == ["tls/127.0.0.1:7447"]
