"""Types of fields that many messages have: names, counts, bounded numbers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

from pydantic import AfterValidator, Field, GetCoreSchemaHandler
from pydantic_core import core_schema

from hmcs.bus.arrays import LARGEST
from hmcs.bus.keys import check_name


@dataclass(frozen=True)
class Within:
    """Refuses numbers whose magnitude is beyond `largest`; its JSON Schema does not say so."""

    largest: int | float

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        return core_schema.no_info_after_validator_function(self._checked, handler(source))

    def _checked(self, value: Any) -> Any:
        if not -self.largest <= value <= self.largest:
            raise ValueError(f"{value!r} is beyond {self.largest:g}")
        return value


Name = Annotated[str, Field(min_length=1, max_length=64)]
Chunk = Annotated[Name, AfterValidator(partial(check_name, "name"))]
"""What can be one chunk of a key, such as the name of a process."""
Count = Annotated[int, Field(ge=0), Within(2**53)]
"""Nothing counts further: a thousand a second for 285 000 years. Sums of counts still fit into a
message."""
Nanoseconds = Annotated[int, Within(2**63 - 1)]
Real = Annotated[float, Within(LARGEST)]
