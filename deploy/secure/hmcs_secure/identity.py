"""Who holds a certificate: its common name says cell, role and, where it is bound, instance."""

from __future__ import annotations

from dataclasses import dataclass

from hmcs.bus.keys import check_name
from hmcs.bus.rights import roles
from hmcs.errors import UserError

ROUTER = "router"
"""The role of routers: they pass on what others say, and say nothing themselves."""
LONGEST_COMMON_NAME = 64
"""Of a certificate, by X.520."""


class IdentityError(UserError):
    """An identity that cannot be; says which part of it and what is valid."""


@dataclass(frozen=True)
class Identity:
    """The holder of a certificate."""

    cell: str
    role: str
    """A role of the table of rights, or `router`."""
    instance: str = ""
    """The one instance that its keys may name; empty leaves it free."""

    def __post_init__(self) -> None:
        check_name("cell", self.cell)
        valid = (*roles(), ROUTER)
        if self.role not in valid:
            raise IdentityError(f"no role {self.role!r} in a cell: choose of {', '.join(valid)}")
        if self.instance:
            check_name("instance", self.instance)
        if len(self.common_name) > LONGEST_COMMON_NAME:
            raise IdentityError(
                f"{self.common_name!r} has {len(self.common_name)} letters, a certificate's common "
                f"name {LONGEST_COMMON_NAME} at most: take shorter names of cell and instance"
            )

    @property
    def common_name(self) -> str:
        """The common name of its certificate, e.g. `demo/robot` or `demo/robot/robot-1`."""
        return "/".join(part for part in (self.cell, self.role, self.instance) if part)

    @property
    def file_name(self) -> str:
        """The name of its files without their endings, e.g. `robot` or `robot@robot-1`."""
        return f"{self.role}@{self.instance}" if self.instance else self.role

    @classmethod
    def of_common_name(cls, common_name: str) -> Identity:
        """Return the identity a common name says. Raises IdentityError or KeyNameError."""
        parts = common_name.split("/")
        if len(parts) not in (2, 3):
            raise IdentityError(
                f"common name {common_name!r}, expected CELL/ROLE or CELL/ROLE/INSTANCE"
            )
        return cls(*parts)
