"""A closed cell as those who start its processes use it: who comes with which certificate."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from hmcs.model_signing import sign_model
from hmcs_secure.authority import Authority, AuthorityError, open_authority
from hmcs_secure.identity import Identity
from hmcs_secure.router_file import DEFAULT_LISTEN, write_router_file

DEFAULT_FOLDER = Path("secure")
"""Where cells keep their certificates, a folder each."""


class Credentials(NamedTuple):
    """The files a process of a closed cell comes with; named as its settings are."""

    tls_ca: Path
    tls_certificate: Path
    tls_key: Path


@dataclass(frozen=True)
class ClosedCell:
    """The folder of a closed cell."""

    authority: Authority
    signed_models: bool = False
    """Whether its processes load only models that are signed for it."""

    @property
    def name(self) -> str:
        """The name of the cell."""
        return self.authority.cell

    def credentials(self, role: str, instance: str = "") -> Credentials:
        """Return what a process comes with: a certificate of its instance, or of its role.

        Raises AuthorityError where neither was issued.
        """
        folder = self.authority.folder / "holders"
        for bound in (instance, "") if instance else ("",):
            file = folder / f"{Identity(self.name, role, bound).file_name}.pem"
            if file.exists():
                return Credentials(
                    self.authority.certificate.resolve(),
                    file.resolve(),
                    file.with_suffix(".key").resolve(),
                )
        raise AuthorityError(
            f"{folder}: no certificate of {role}: issue one with `hmcs secure issue {self.name} "
            f"{role}`"
        )

    def environment(self, role: str, instance: str) -> dict[str, str]:
        """Return the settings that a process of the cell is started with."""
        files = self.credentials(role, instance)
        environment = {"HMCS_CELL": self.name}
        environment |= {f"HMCS_{name.upper()}": str(file) for name, file in files._asdict().items()}
        if self.signed_models:
            environment["HMCS_MODEL_KEY"] = str(self.authority.model_key.resolve())
        return environment

    def sign(self, models: Iterable[Path]) -> None:
        """Sign models that were made by the cell itself."""
        for model in models:
            sign_model(model, self.authority.model_signing_key)

    def write_router(self, target: Path, listen: str = DEFAULT_LISTEN) -> Path:
        """Write the configuration of its router as it is to be now; return the file."""
        return write_router_file(self.authority, target, listen=listen)


def find_closed_cell(named: str, *, signed_models: bool = False) -> ClosedCell:
    """Return the closed cell of this name, or of this folder. Raises AuthorityError for neither."""
    folder = Path(named)
    if not (folder / "ca.pem").exists():
        folder = DEFAULT_FOLDER / named
    return ClosedCell(open_authority(folder), signed_models)
