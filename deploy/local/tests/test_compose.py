from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from hmcs.bus.rights import roles
from hmcs_local.compose import ComposeError, find_compose, load_compose

Describe = Callable[..., dict[str, Any]]


def test_services_come_after_what_they_need(
    write_compose: Callable[..., Path], service: Describe
) -> None:
    path = write_compose(
        last=service(depends_on={"first": {"condition": "service_completed_successfully"}}),
        first=service(depends_on=["router"]),
    )
    stack = load_compose(path, {})
    order = list(stack.services)
    assert order.index("router") < order.index("first") < order.index("last")
    assert [spec.one_shot for spec in stack.services.values()] == [False, True, False]


def test_variables_are_filled_in_and_fall_back_to_their_default(
    write_compose: Callable[..., Path], service: Describe
) -> None:
    environment = {"A": "${SET:-no}", "B": "${UNSET:-fallback}", "C": "${UNSET}", "D": "$$X"}
    path = write_compose(it=service(environment=environment))
    filled = load_compose(path, {"SET": "yes"}).services["it"].environment
    assert filled == {"A": "yes", "B": "fallback", "C": "", "D": "$X"}


def test_grace_restart_scale_and_volumes_are_read(
    write_compose: Callable[..., Path], service: Describe
) -> None:
    path = write_compose(
        it=service(
            stop_grace_period="500ms",
            restart="on-failure",
            scale=3,
            volumes=["data:/data:ro", "./tasks:/tasks:ro", "/srv/a:/a"],
        )
    )
    spec = load_compose(path, {}).services["it"]
    assert (spec.stop_grace_s, spec.restart, spec.scale) == (0.5, "on-failure", 3)
    assert spec.volumes == {"/data": "data"}
    assert spec.mounts == {"/tasks": path.parent.resolve() / "tasks", "/a": Path("/srv/a")}


def test_an_unknown_service_is_refused_with_the_valid_choices(
    write_compose: Callable[..., Path], service: Describe
) -> None:
    stack = load_compose(write_compose(it=service()), {})
    with pytest.raises(ComposeError, match=r"unknown service 'its'.* \(choose of: "):
        stack.select(("its",))


@pytest.mark.parametrize(
    ("more", "complaint"),
    [
        ({"command": "python -m it"}, r"services\.it\.command: expected a list"),
        ({"environment": ["A=1"]}, r"services\.it\.environment: expected a mapping"),
        ({"restart": "sometimes"}, r"services\.it\.restart: 'sometimes'"),
        ({"stop_grace_period": "soon"}, r"services\.it\.stop_grace_period: 'soon'"),
        ({"volumes": ["./here"]}, r"services\.it\.volumes: expected NAME:/folder or"),
        ({"scale": "many"}, r"services\.it\.scale: 'many'"),
        ({"depends_on": ["nobody"]}, "depends on 'nobody', which is not there"),
        ({"depends_on": ["it"]}, "services wait for each other"),
    ],
)
def test_what_cannot_be_run_is_named_with_its_place(
    write_compose: Callable[..., Path], service: Describe, more: dict[str, Any], complaint: str
) -> None:
    path = write_compose(it=service(**more))
    with pytest.raises(ComposeError, match=complaint):
        load_compose(path, {})


@pytest.mark.parametrize("text", ["", "services: [", "[]", "services:\n  it: 3\n"])
def test_a_file_that_describes_no_stack_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "compose.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ComposeError, match=r"compose\.yaml: "):
        load_compose(path, {})


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ComposeError, match="cannot be read"):
        load_compose(tmp_path / "none.yaml", {})


def test_the_stack_of_this_checkout_can_be_run() -> None:
    stack = load_compose(find_compose(Path(__file__).parent), {})
    assert next(iter(stack.services)) == "router"
    assert stack.services["gesteme-classifier"].scale == 2
    assert [name for name, spec in stack.services.items() if spec.one_shot] == ["teach"]


def test_every_port_of_the_stack_is_reached_from_this_machine_alone_by_default() -> None:
    document = yaml.safe_load(find_compose(Path(__file__).parent).read_text(encoding="utf-8"))
    ports = [
        re.sub(r"\$\{\w+:-([^}]*)\}", r"\1", port)
        for service in document["services"].values()
        for port in service.get("ports", [])
    ]
    assert sorted(ports) == ["127.0.0.1:7447:7447", "127.0.0.1:8080:8080"]


def test_in_a_closed_cell_every_service_comes_with_the_certificate_of_its_own_role() -> None:
    folder = find_compose(Path(__file__)).parent
    everything = yaml.safe_load((folder / "compose.yaml").read_text())["services"]
    closed = yaml.safe_load((folder / "compose.secure.yaml").read_text())["services"]
    on_the_bus = {
        name for name, it in everything.items() if "HMCS_ROUTER" in it.get("environment", {})
    }
    assert set(closed) == on_the_bus | {"router"}
    for name in on_the_bus:
        mounted = dict(
            each.removesuffix(":ro").rsplit(":", 1)[::-1] for each in closed[name]["volumes"]
        )
        holder = f"holders/{name.replace('-', '_')}"
        environment = closed[name]["environment"]
        assert environment["HMCS_ROUTER"].startswith("tls/router:")
        assert mounted[environment["HMCS_TLS_CERTIFICATE"]].endswith(f"/{holder}.pem")
        assert mounted[environment["HMCS_TLS_KEY"]].endswith(f"/{holder}.key")
        assert mounted[environment["HMCS_TLS_CA"]].endswith("/ca.pem")
        assert name.replace("-", "_") in roles()
