"""`hmcs secure …` as a person uses it."""

from __future__ import annotations

import json
import os
import re
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from hmcs.model_signing import SignatureError, sign_model, signed_by
from hmcs_secure import command
from hmcs_secure.authority import AuthorityError, holders_of, open_authority, utc_now
from hmcs_secure.identity import IdentityError


@pytest.fixture
def call(tmp_path: Path):
    """Run a command on the cells in a folder."""

    def run(*words: str, fails: bool = False) -> Result:
        done = CliRunner().invoke(command.app, [*words, "--folder", str(tmp_path)])
        if done.exception is not None and not isinstance(done.exception, SystemExit):
            raise done.exception
        assert (done.exit_code != 0) == fails, done.output
        return done

    return run


def configured(file: Path) -> Any:
    text = file.read_text(encoding="utf-8")
    return json.loads(re.sub(r"^//.*\n", "", text, flags=re.MULTILINE))


def test_a_new_cell_has_a_certificate_for_every_role_and_a_router(call, tmp_path) -> None:
    reported = call("init", "lab").output
    assert "Keep" in reported
    assert "ca.key" in reported
    configuration = configured(tmp_path / "lab" / "router.json5")
    assert configuration["access_control"]["default_permission"] == "deny"
    assert "every certificate" not in call("check", "lab").output
    assert "lab/robot" in call("check", "lab").output


def test_a_certificate_issued_later_is_known_to_the_routers_file(call, tmp_path) -> None:
    call("init", "lab")
    call("issue", "lab", "gesteme_classifier", "--instance", "gc-1")
    assert "lab/gesteme_classifier/gc-1" in (tmp_path / "lab" / "router.json5").read_text()


def test_what_expires_soon_is_reported_and_renewed(call, monkeypatch, tmp_path) -> None:
    call("init", "lab")
    later = utc_now() + timedelta(days=350)
    monkeypatch.setattr(command, "utc_now", lambda: later)
    assert "expires soon" in call("check", "lab", fails=True).output
    call("renew", "lab")
    call("check", "lab")
    assert open_authority(tmp_path / "lab").cell == "lab"


def test_containers_get_a_router_named_as_theirs_and_keys_of_their_own(
    call, monkeypatch, tmp_path
) -> None:
    owners: dict[Path, int] = {}
    monkeypatch.setattr(os, "chown", lambda path, user, group: owners.update({path: user}))
    call("init", "lab", "--host", "robot.example")
    cell = tmp_path / "lab"
    assert "compose.secure.yaml" in call("containers", "lab").output
    holders = holders_of(open_authority(cell))
    router = next(h for h in holders if h.identity.role == "router")
    assert {"router", "robot.example", "localhost"} <= set(router.hosts)
    assert owners == {h.key: 10001 for h in holders}
    issued = router.certificate.read_bytes()
    call("containers", "lab")
    assert router.certificate.read_bytes() == issued
    configuration = configured(cell / "router.containers.json5")
    assert configuration["listen"]["endpoints"] == ["tls/0.0.0.0:7447"]
    credentials = configuration["transport"]["link"]["tls"]
    assert credentials["root_ca_certificate"] == "/secure/ca.pem"
    assert credentials["listen_private_key"] == "/secure/holders/router.key"


def test_who_may_not_hand_keys_over_learns_what_to_do(call, monkeypatch) -> None:
    def refuses(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "chown", refuses)
    call("init", "lab")
    with pytest.raises(AuthorityError, match="run this as root"):
        call("containers", "lab")


def test_a_key_that_others_may_read_is_reported(call, tmp_path) -> None:
    call("init", "lab")
    (tmp_path / "lab" / "holders" / "robot.key").chmod(0o644)
    assert "others may read" in " ".join(call("check", "lab", fails=True).output.split())


def test_mistakes_are_reported(call) -> None:
    with pytest.raises(AuthorityError, match="make one with `hmcs secure init`"):
        call("check", "lab")
    call("init", "lab")
    with pytest.raises(IdentityError, match="no role 'roboter'"):
        call("issue", "lab", "roboter")


def test_a_signed_model_is_distinguished_from_one_that_was_changed(call, tmp_path) -> None:
    call("init", "lab")
    cell, model = tmp_path / "lab", tmp_path / "mine.hmcs"
    model.write_bytes(b"a model")
    verify = signed_by(cell / "models.pub")
    assert verify is not None
    with pytest.raises(SignatureError, match="is not signed"):
        verify(model, b"a model")
    call("sign", "lab", str(model))
    verify(model, b"a model")
    with pytest.raises(SignatureError, match="not of this cell's key"):
        verify(model, b"another model")
    call("init", "other")
    sign_model(model, tmp_path / "other" / "models.key")
    with pytest.raises(SignatureError, match="not of this cell's key"):
        verify(model, b"a model")


@pytest.mark.parametrize("signature", [b"", b"!!!", b"\xff" * 100, b"AAAA" * 10])
def test_a_signature_that_is_none_is_refused(call, tmp_path, signature) -> None:
    call("init", "lab")
    model = tmp_path / "mine.hmcs"
    model.write_bytes(b"a model")
    (tmp_path / "mine.hmcs.sig").write_bytes(signature)
    verify = signed_by(tmp_path / "lab" / "models.pub")
    assert verify is not None
    with pytest.raises(SignatureError):
        verify(model, b"a model")


def test_without_a_key_nothing_is_verified() -> None:
    assert signed_by(None) is None
