"""The README and the pages whose commands start a stack, followed in an empty folder.

Only ports are changed, and who drives: on the page that would be a person.
"""

from __future__ import annotations

import importlib.util
import socket
import ssl
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
)
from cryptography.x509.oid import NameOID

from hmcs.bus.messages import FixtureState
from hmcs.bus.session import Bus
from hmcs.motion.demonstrations import read_csv, write_csv
from hmcs.recognition.model_file import load_model
from hmcs_local.stack import with_free_port
from support.pages import ROOT, Reader, blocks, lines_of
from support.stack import Stack
from support.waiting import operator_at, wait_present, wait_until

OWN_RECOGNIZER = "docs/how-to/own-recognizer.md"
SEVERAL_HOSTS = "docs/how-to/several-hosts.md"
CLOSED_CELL = "docs/how-to/closed-cell.md"
ROS2 = "docs/how-to/ros2.md"
ROUTER = "tcp/127.0.0.1:7447"
"""As the pages have it."""
needs_ros = pytest.mark.skipif(
    importlib.util.find_spec("rclpy") is None, reason="rclpy has no wheels for this Python"
)


@pytest.fixture
def router() -> str:
    return with_free_port("tcp/127.0.0.1:0")


@pytest.fixture
def reader(tmp_path: Path, router: str) -> Iterator[Reader]:
    with Reader(tmp_path, HMCS_ROUTER=router) as reader:
        yield reader


@pytest.fixture
def joined(reader: Reader) -> Iterator[Callable[[str], Bus]]:
    buses: list[Bus] = []

    def join(router: str) -> Bus:
        def there() -> Bus | None:
            reader.check_all_run()
            return operator_at(router)

        buses.append(wait_until(there, "the router"))
        return buses[-1]

    yield join
    for bus in buses:
        bus.close()


def followed_model(bus: Bus, model: str) -> None:
    """Wait until the fixture follows a model."""
    said: list[str] = []
    subscription = bus.subscribe(
        FixtureState, bus.keys.fixture_state, lambda received: said.append(received.body.model)
    )

    def followed() -> bool:
        bus.pump(0.05)
        return bool(said) and said[-1] == model

    wait_until(followed, f"the fixture that follows {model}")
    del subscription


def only(page: str, beginning: str) -> str:
    """Return the one command of a page that begins so."""
    (line,) = [line for block in lines_of(page) for line in block if line.startswith(beginning)]
    return line


def test_the_daily_use_of_the_readme_from_a_new_task_to_its_own_model(
    reader: Reader, router: str, joined: Callable[[str], Bus]
) -> None:
    (daily,) = [block for block in lines_of("README.md") if block[-1].startswith("docker")]
    _activate, _demo, new, up, status, train, deploy, stop, _containers = daily
    reader.run(new)
    reader.start(up.replace("my-task.yaml", f"my-task.yaml --router {router}", 1))
    bus = joined(router)
    wait_present(bus, "robot", "fixture_controller", "recorder", "trainer", "console")
    assert "robot" in reader.tried(status).stdout
    # What a person does on the page: three recordings, the hand of which is that of the examples.
    recordings = reader.folder / "out/up/recordings"
    recordings.mkdir(parents=True, exist_ok=True)
    names = {"reach": "approach", "turn": "work", "lift": "retract"}
    for number in (1, 2, 3):
        shown = read_csv(ROOT / f"examples/data/hand-{number}.csv")
        begin = shown.positions[0]
        shown = shown._replace(
            # The room of a new task is smaller than that of the examples.
            positions=begin + 0.5 * (shown.positions - begin),
            states=tuple(state and names[state] for state in shown.states),
        )
        write_csv(recordings / f"take-{number}.csv", shown)
    reader.run(train)
    assert load_model(reader.folder / "mine.hmcs").name == "mine"
    # On a machine that is busy a process is not ready in the time that `hmcs deploy` gives it.
    wait_until(lambda: reader.tried(deploy).returncode == 0, deploy)
    followed_model(bus, "mine")
    reader.run(stop)


def test_the_recognizer_of_the_page_becomes_the_active_one_and_leaves_again(
    reader: Reader, router: str, joined: Callable[[str], Bus]
) -> None:
    (program,) = blocks(OWN_RECOGNIZER, "python")
    (reader.folder / "my_recognizer.py").write_text(program, encoding="utf-8")
    start, take_over, back = (line for block in lines_of(OWN_RECOGNIZER) for line in block)
    reader.start(f"hmcs up --router {router}")
    bus = joined(router)
    wait_present(bus, "robot", "fixture_controller", "task_hmm", "gesteme_classifier")
    reader.start(start)
    wait_present(bus, "my_recognizer")
    reader.run(take_over)
    followed_model(bus, "most-alike")
    reader.run(back)
    followed_model(bus, "human-shapes")
    reader.check_all_run()


def test_a_second_host_joins_by_the_router_of_the_page_and_has_its_models_by_itself(
    stack: Stack, reader: Reader, model_file: Path, joined: Callable[[str], Bus]
) -> None:
    mine = with_free_port("tcp/0.0.0.0:0")
    nobody = with_free_port("tcp/127.0.0.1:0")
    (config,) = blocks(SEVERAL_HOSTS, "json5")
    config = (
        config.replace("tcp/0.0.0.0:7447", mine)
        .replace("tcp/ROBOT-HOST:7447", stack.endpoint)
        .replace("tcp/RECOGNIZER-HOST:7447", nobody)
    )
    (reader.folder / "router.json5").write_text(config, encoding="utf-8")
    here = mine.replace("0.0.0.0", "127.0.0.1")
    # The robot's host is the one that has the model.
    stack.watch(stack.open_bus("observer", "looks"))
    stack.bring_up("fixture_controller", "f", "--models", model_file)
    reader.start(only(SEVERAL_HOSTS, "hmcs router"))
    joined(here)
    reader.start(only(SEVERAL_HOSTS, "hmcs up").replace(ROUTER, here))
    robots = joined(stack.endpoint)
    wait_present(robots, "gesteme_classifier", "task_hmm")
    fetched = reader.folder / "out/up/models" / model_file.name
    assert load_model(fetched).hash == load_model(model_file).hash


def test_the_page_is_opened_to_other_hosts_by_https(
    stack: Stack, reader: Reader, joined: Callable[[str], Bus]
) -> None:
    write_certificate(reader.folder / "page.pem", reader.folder / "page.key")
    port = with_free_port("tcp/127.0.0.1:0").rpartition(":")[2]
    reader.environment |= {"HMCS_ROUTER": stack.endpoint, "HMCS_PORT": port}
    reader.start(only(SEVERAL_HOSTS, "HMCS_TOKEN="))
    wait_present(joined(stack.endpoint), "console")
    context = ssl.create_default_context(cafile=str(reader.folder / "page.pem"))
    with (
        socket.create_connection(("127.0.0.1", int(port)), timeout=30.0) as raw,
        context.wrap_socket(raw, server_hostname="robot.example") as page,
    ):
        page.sendall(b"GET / HTTP/1.1\r\nHost: robot.example\r\nConnection: close\r\n\r\n")
        assert page.recv(12).startswith(b"HTTP/1.1 4")


def test_a_closed_cell_is_opened_run_looked_at_and_signed_for(reader: Reader) -> None:
    endpoint = with_free_port("tls/127.0.0.1:0")
    reader.environment["HMCS_ROUTER"] = endpoint
    begin, issue, containers, hosts, sign = lines_of(CLOSED_CELL)
    init, up, status, check, renew = begin
    reader.run(init)
    reader.start(f"{up.partition('#')[0]} --router {endpoint}")

    def well() -> bool:
        reader.check_all_run()
        return reader.tried(status).returncode == 0

    wait_until(well, "a stack that is well")
    for line in (check, renew, *issue, containers[-1]):
        reader.run(line)
    reader.end_all()

    (signs, up_signed) = sign
    reader.run(signs)
    assert list((reader.folder / "out/up/models").glob("*.sig"))
    reader.start(f"{up_signed.partition('#')[0]} --router {endpoint}")
    wait_until(well, "a stack of signed models that is well")
    reader.end_all()

    name, write, run = hosts
    port = with_free_port("tls/0.0.0.0:0")
    reader.run(name)
    reader.run(write.replace("tls/0.0.0.0:7447", port))
    reader.start(run)

    def listens() -> bool:
        reader.check_all_run()
        with socket.socket() as there:
            return there.connect_ex(("127.0.0.1", int(port.rpartition(":")[2]))) == 0

    wait_until(listens, "the router")


@needs_ros
def test_the_processes_of_the_page_on_ros_2_start_beside_a_stack(
    reader: Reader, router: str, joined: Callable[[str], Bus]
) -> None:
    reader.run("hmcs new my-task")
    reader.start(f"hmcs up --services router,fixture-controller,console --router {router}")
    bus = joined(router)
    watch, renamed = (
        line
        for block in lines_of(ROS2)
        for line in block
        if line.partition("#")[0].split()[:3] == ["python", "-m", "hmcs_ros2_bridge"]
    )
    reader.start(watch)
    wait_present(bus, "ros2_bridge")
    reader.environment["HMCS_INSTANCE"] = "renamed"
    reader.start(renamed)
    reader.start(only(ROS2, "python -m hmcs_ros2_bridge.robot"))
    reader.start(only(ROS2, "python -m hmcs_input_device"))

    def all_there() -> bool:
        bus.pump(0.05)
        members = bus.present(bus.keys.presence("ros2_bridge")).members
        return {member.instance for member in members} >= {"renamed"}

    wait_until(all_there, "the bridge with other names")
    wait_present(bus, "robot", "input_device")
    reader.check_all_run()


def write_certificate(certificate: Path, key: Path) -> None:
    """Write a certificate that signs itself, for the host of the page."""
    private = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "robot.example")])
    now = datetime.now(UTC)
    made = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(private.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(days=1))
        .not_valid_after(now + timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName([x509.DNSName("robot.example")]), False)
        .sign(private, SHA256())
    )
    certificate.write_bytes(made.public_bytes(Encoding.PEM))
    key.write_bytes(private.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))
