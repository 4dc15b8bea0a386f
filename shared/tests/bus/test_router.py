from __future__ import annotations

import contextlib
import signal
import socket
from pathlib import Path

import psutil
import pytest
import zenoh

from hmcs.bus import config, health
from hmcs.bus.config import opens_to_network, router_config
from hmcs.bus.router import RouterError, main, open_router
from hmcs.bus.session import Bus, BusSettings

JSON5 = Path(__file__).parents[3] / "deploy/router/router.json5"


def test_two_routers_on_one_port_are_a_clear_error(router) -> None:
    with pytest.raises(RouterError, match=r"is taken.*cannot be two on one port"):
        open_router(router)


def test_a_second_router_process_ends_with_code_2_and_one_line(router, capsys) -> None:
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    assert main(["--listen", router]) == 2
    assert signal.pthread_sigmask(signal.SIG_BLOCK, []) == mask
    error = capsys.readouterr().err
    assert "is taken" in error
    assert len(error.splitlines()) == 1


@pytest.mark.parametrize("endpoint", ["7447", "localhost:7447", "tcp/", ""])
def test_what_is_no_endpoint_is_reported(endpoint) -> None:
    with pytest.raises(RouterError, match="no endpoint"):
        open_router(endpoint)


@pytest.mark.parametrize("content", ["{a:", "{listen: 7}", '{mode: "star"}', None])
def test_a_file_that_is_no_configuration_is_reported_by_name(
    tmp_path, content, free_endpoint
) -> None:
    path = tmp_path / "router.json5"
    if content is not None:
        path.write_text(content)
    with pytest.raises(RouterError, match=r"router\.json5"):
        open_router(free_endpoint, path)


def test_the_shipped_configuration_makes_a_router(free_endpoint) -> None:
    with (
        open_router(free_endpoint, JSON5),
        Bus.open(BusSettings(router=free_endpoint, connect_timeout_s=5), "tester", "a") as bus,
    ):
        assert bus.connected


def test_the_shipped_configuration_says_what_the_code_says() -> None:
    shipped, ours = zenoh.Config.from_file(JSON5), router_config()
    for path in (
        "mode",
        "listen/endpoints",
        "scouting/delay",
        "scouting/multicast/enabled",
        "transport/unicast",
        "transport/link/tx/lease",
        "transport/link/tx/queue/congestion_control/drop/wait_before_drop",
    ):
        assert shipped.get_json(path) == ours.get_json(path), path


def test_a_router_process_is_healthy_and_ends_cleanly(spawn, free_endpoint, until) -> None:
    process = spawn(
        "import sys; from hmcs.bus.router import main; sys.exit(main(sys.argv[1:]))",
        "--listen",
        free_endpoint,
    )
    check = ["--service", "router", "--router", free_endpoint]
    until(lambda: health.main(check) == 0)
    process.send_signal(signal.SIGTERM)
    assert process.wait(5) == 0
    assert health.main(check) == 1


@pytest.mark.parametrize(
    "endpoint",
    [
        "tcp/0.0.0.0:7447",
        "tcp/[::]:7447",
        "tcp/192.0.2.7:7447",
        "udp/0.0.0.0:7447",
        "ws/0.0.0.0:7447",
        "tcp/*:7447",
        "tcp/:7447",
        "tcp/127.evil.test:7447",
        "tcp/localhost.evil.test:7447",
        "tcp/0.0.0.0:7447#iface=lo",
        "tcp/0.0.0.0:7447?rel=1",
    ],
)
def test_what_other_hosts_reach_without_tls_is_refused_until_it_is_asked_for(endpoint) -> None:
    assert opens_to_network(endpoint)
    with pytest.raises(RouterError, match=r"can move the robot.*--open-to-network"):
        open_router(endpoint)


@pytest.mark.parametrize(
    "endpoint",
    [
        "tcp/127.0.0.1:7447",
        "tcp/127.3.2.1:7447",
        "tcp/[::1]:7447",
        "tcp/localhost:7447",
        "tcp/127.0.0.1:7447#iface=lo",
        "tls/0.0.0.0:7447",
        "quic/[::]:7447",
        "unixsock-stream//tmp/router.sock",
    ],
)
def test_this_machine_and_tls_need_not_be_asked_for(endpoint) -> None:
    assert not opens_to_network(endpoint)


@pytest.mark.parametrize(
    "listen",
    [
        '{endpoints: ["tcp/127.0.0.1:1", "tcp/0.0.0.0:2"]}',
        '{endpoints: {router: ["tcp/0.0.0.0:2"], peer: []}}',
        "{}",
    ],
    ids=["one of two", "by mode", "named by Zenoh itself"],
)
def test_a_file_that_opens_the_router_to_the_network_is_refused(tmp_path, listen) -> None:
    path = tmp_path / "router.json5"
    path.write_text(f"{{listen: {listen}}}")
    with pytest.raises(RouterError, match="--open-to-network"):
        open_router(config=path)


def port_of(endpoint: str) -> str:
    return endpoint.rpartition(":")[2]


def test_a_router_that_is_asked_to_listens_beyond_this_machine(free_endpoint) -> None:
    everywhere = f"tcp/0.0.0.0:{port_of(free_endpoint)}"
    with (
        open_router(everywhere, open_to_network=True),
        Bus.open(BusSettings(router=free_endpoint, connect_timeout_s=5), "tester", "a") as bus,
    ):
        assert bus.connected


@pytest.mark.parametrize(
    ("words", "value", "opens"),
    [
        ([], "", False),
        ([], "false", False),
        ([], "0", False),
        ([], "true", True),
        (["--open-to-network"], "", True),
    ],
)
def test_flag_and_environment_open_a_router_process(
    spawn, free_endpoint, until, words, value, opens
) -> None:
    process = spawn(
        "import sys; from hmcs.bus.router import main; sys.exit(main(sys.argv[1:]))",
        *("--listen", f"tcp/0.0.0.0:{port_of(free_endpoint)}", *words),
        HMCS_OPEN_TO_NETWORK=value,
    )
    until(lambda: "ready" in process.log.read_text() or process.poll() is not None)
    assert process.poll() == (None if opens else 2)


@pytest.mark.parametrize("opens", [False, True])
def test_a_direct_process_listens_on_this_machine_alone_until_it_is_asked_to(join, opens) -> None:
    def listening() -> set[str]:
        found = psutil.Process().net_connections("tcp")
        return {each.laddr.ip for each in found if each.status == psutil.CONN_LISTEN}

    assert listening() == {"127.0.0.1"}, "the router of this test"
    join("tester", "a", direct=True, open_to_network=opens)
    assert listening() == ({"127.0.0.1", "::"} if opens else {"127.0.0.1"})


def test_idle_connections_leave_room_for_new_sessions(free_endpoint, monkeypatch) -> None:
    monkeypatch.setattr(config, "ACCEPTING_MS", 600_000)
    with open_router(free_endpoint), contextlib.ExitStack() as idle:
        for _ in range(400):
            address = ("127.0.0.1", int(port_of(free_endpoint)))
            idle.enter_context(socket.create_connection(address))
        with Bus.open(BusSettings(router=free_endpoint, connect_timeout_s=20), "t", "a") as bus:
            assert bus.connected


@pytest.mark.long
def test_a_connection_that_says_nothing_is_closed(free_endpoint, monkeypatch) -> None:
    monkeypatch.setattr(config, "ACCEPTING_MS", 100)
    with open_router(free_endpoint):
        address = ("127.0.0.1", int(port_of(free_endpoint)))
        with socket.create_connection(address, timeout=8) as idle:
            assert idle.recv(1) == b""
