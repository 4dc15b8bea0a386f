"""The manifests are those of compose.yaml, and a cluster would take them."""

from __future__ import annotations

from pathlib import Path

import kubernetes_validate
import pytest
import yaml

from hmcs_local.compose import ROUTER, load_compose
from hmcs_local.kubernetes import as_yaml, main, manifests

ROOT = Path(__file__).parents[3]
COMPOSE = ROOT / "compose.yaml"
VERSIONS = ("1.29.0", "1.31.0")


def of_kind(kind: str) -> list[dict]:
    return [each for each in manifests(COMPOSE) if each["kind"] == kind]


def test_the_committed_manifests_are_generated_from_compose() -> None:
    committed = (ROOT / "deploy" / "kubernetes" / "hmcs.yaml").read_text(encoding="utf-8")
    assert committed == as_yaml(manifests(COMPOSE)), "run `make manifests`"


@pytest.mark.parametrize("version", VERSIONS)
def test_every_manifest_fits_the_schemas_of_kubernetes(version) -> None:
    for manifest in yaml.safe_load_all(as_yaml(manifests(COMPOSE))):
        kubernetes_validate.validate(manifest, version, strict=True)


def test_every_service_of_the_stack_runs_with_its_command_and_settings() -> None:
    stack = load_compose(COMPOSE, {})
    pods = {each["metadata"]["name"]: each["spec"]["template"]["spec"] for each in
            (*of_kind("Deployment"), *of_kind("Job"))}  # fmt: skip
    # What is behind a profile is no part of the stack by default.
    services = {name: spec for name, spec in stack.services.items() if not spec.optional}
    assert set(pods) == set(services)
    for name, spec in services.items():
        (container,) = pods[name]["containers"]
        assert tuple(container.get("args", ())) == spec.command
        assert {each["name"]: each["value"] for each in container["env"]} == dict(spec.environment)
        assert {m["mountPath"]: m["name"] for m in container["volumeMounts"]} == dict(spec.volumes)


def test_nobody_outside_of_the_namespace_reaches_the_router() -> None:
    (service,) = of_kind("Service")
    assert service["metadata"]["name"] == ROUTER
    assert service["spec"].get("type", "ClusterIP") == "ClusterIP"
    (policy,) = of_kind("NetworkPolicy")
    assert policy["spec"]["policyTypes"] == ["Ingress"]
    assert policy["spec"]["ingress"] == [{"from": [{"podSelector": policy["spec"]["podSelector"]}]}]


def test_pods_run_without_rights_and_within_their_memory() -> None:
    for each in (*of_kind("Deployment"), *of_kind("Job")):
        pod = each["spec"]["template"]["spec"]
        assert pod["securityContext"]["runAsNonRoot"]
        for container in (*pod["containers"], *pod.get("initContainers", ())):
            assert container["securityContext"]["capabilities"] == {"drop": ["ALL"]}
            assert "memory" in container["resources"]["limits"]


def test_what_a_job_makes_is_waited_for() -> None:
    waiting = {
        each["metadata"]["name"]
        for each in of_kind("Deployment")
        if "initContainers" in each["spec"]["template"]["spec"]
    }
    assert {"gesteme-classifier", "task-hmm", "fixture-controller", "input-device"} <= waiting
    assert ROUTER not in waiting


def test_a_compose_file_that_is_none_is_reported(tmp_path, capsys) -> None:
    file = tmp_path / "compose.yaml"
    file.write_text("services: 3\n")
    assert main(["", str(file), str(tmp_path / "out.yaml")]) == 2
    assert "expected a compose file" in capsys.readouterr().err
    assert not (tmp_path / "out.yaml").exists()
