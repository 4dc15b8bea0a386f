"""What a console can be told."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field, SecretStr, ValidationInfo, field_validator

from hmcs.bus.settings import EMPTY_IS_NONE, ServiceSettings
from hmcs_console.serving.admission import is_loopback


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
        host = info.data.get("host", "")
        if token is None and host and not is_loopback(host):
            raise ValueError(
                f"host {host} can be reached from other machines, and whoever reaches the page "
                "can move the robot: give a token, or a loopback host"
            )
        return token
