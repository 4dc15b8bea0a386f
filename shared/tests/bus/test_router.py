from __future__ import annotations

import signal
from pathlib import Path

import pytest
import zenoh

from hmcs.bus import health
from hmcs.bus.config import router_config
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
def test_what_is_no_endpoint_is_told(endpoint) -> None:
    with pytest.raises(RouterError, match="no endpoint"):
        open_router(endpoint)


@pytest.mark.parametrize("content", ["{a:", "{listen: 7}", '{mode: "star"}', None])
def test_a_file_that_is_no_configuration_is_told_by_name(tmp_path, content, free_endpoint) -> None:
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
        "scouting/delay",
        "scouting/multicast/enabled",
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
