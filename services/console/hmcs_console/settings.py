"""Settings of the console."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field, SecretStr, ValidationInfo, field_validator

from hmcs.bus.settings import EMPTY_IS_NONE, ServiceSettings
from hmcs_console.serving.places import is_loopback, is_name


class ConsoleSettings(ServiceSettings):
    """The operator's page: shows everything there is on the bus, and can do everything."""

    host: str = "127.0.0.1"
    """Where the page is served; anything but a loopback address needs a token."""
    port: int = Field(default=8080, ge=0, le=65_535)
    """Of the page; the next free one where it is taken, any free one for 0."""
    token: Annotated[SecretStr | None, EMPTY_IS_NONE] = Field(
        default=None, min_length=8, validate_default=True
    )
    """Who opens the page with `?token=…` is let in; without one everybody on this machine is."""
    page_names: tuple[str, ...] = ()
    """Names the page may be opened by, beside its addresses and localhost, e.g. `robot.example`;
    under any other name it is refused."""
    page_certificate: Annotated[Path | None, EMPTY_IS_NONE] = None
    """PEM file of a certificate; with it the page is served encrypted (https, wss) and no other
    way."""
    page_key: Annotated[Path | None, EMPTY_IS_NONE] = Field(default=None, validate_default=True)
    """PEM file of the key of `page_certificate`, without a password."""
    rate_hz: float = Field(default=30.0, ge=2, le=100)
    """How often the page is drawn at best."""
    lease_s: float = Field(default=0.25, ge=0.1, le=2.0)
    """An operator whose page gives no sign of life for so long has let go."""
    compare_s: float = Field(default=5.0, ge=0, le=600)
    """How long a newcomer among the recognizers is compared with the active one before it is
    activated; 0 for not at all."""
    models: tuple[Path, ...] = ()
    """Model files, or folders of them, whose learned paths are drawn."""
    task: str | None = None
    """Name of a task that comes along, or a task file, whose workspace is drawn; the task of the
    first model by default."""

    @field_validator("token")
    @classmethod
    def _is_given_where_others_can_reach_the_page(
        cls, token: SecretStr | None, info: ValidationInfo
    ) -> SecretStr | None:
        host = info.data.get("host")
        if token is None and host is not None and not is_loopback(host):
            raise ValueError(
                f"host {host!r} can be reached from other machines, and who reaches the page "
                "can move the robot: give a token, or a loopback host"
            )
        return token

    @field_validator("page_names")
    @classmethod
    def _are_names(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        wrong = [name for name in names if not is_name(name)]
        if wrong:
            raise ValueError(
                f"{', '.join(map(repr, wrong))} is no name of a host: give names without scheme "
                "and port, e.g. robot.example"
            )
        return names

    @field_validator("page_key")
    @classmethod
    def _goes_with_a_certificate(cls, key: Path | None, info: ValidationInfo) -> Path | None:
        if "page_certificate" in info.data and (key is None) != (
            info.data["page_certificate"] is None
        ):
            raise ValueError("a certificate and its key go together: give both, or neither")
        return key
