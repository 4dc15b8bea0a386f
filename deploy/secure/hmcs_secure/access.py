"""From the table of rights to what a Zenoh router enforces: access control and sizes.

Whatever no rule allows is denied. A message crosses a router twice: in from its sender (`ingress`)
and out to its receivers (`egress`); a right needs the rules of both ends, and for what answers it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from hmcs.bus.bounds import BOUNDS
from hmcs.bus.contract_page import published_keys
from hmcs.bus.keys import ANY, Keys
from hmcs.bus.rights import rights_of
from hmcs.bus.verbs import VERBS
from hmcs_secure.identity import ROUTER, Identity

INGRESS, EGRESS = "ingress", "egress"
OVERHEAD_BYTES = 1024
"""What Zenoh may add to a payload before it compares sizes."""


def access_control(holders: Iterable[Identity]) -> dict[str, Any]:
    """Return the `access_control` of a router for the holders of certificates."""
    rules: list[dict[str, Any]] = []
    subjects: list[dict[str, Any]] = []
    policies: list[dict[str, Any]] = []
    for holder in holders:
        own = list(_rules_of(holder))
        rules += own
        subjects.append({"id": holder.common_name, "cert_common_names": [holder.common_name]})
        policies.append({"rules": [rule["id"] for rule in own], "subjects": [holder.common_name]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def size_limits(cell: str) -> list[dict[str, Any]]:
    """Return the `low_pass_filter` of a router of a cell: the bound of every published message."""
    keys = Keys(cell)
    return [
        {
            "id": f"size of {message.SCHEMA}",
            "messages": ["put"],
            "flows": [INGRESS],
            "key_exprs": [key.replace("MODEL", ANY).replace("INSTANCE", ANY)],
            "size_limit": BOUNDS[message].size_bytes + OVERHEAD_BYTES,
        }
        for message, key in published_keys(keys).items()
    ]


def _rules_of(holder: Identity) -> Iterator[dict[str, Any]]:
    keys = Keys(holder.cell)

    def rule(what: str, messages: list[str], flow: str, on: Iterable[str]) -> dict[str, Any]:
        return {
            "id": f"{holder.common_name} {what}",
            "permission": "allow",
            "messages": messages,
            "flows": [flow],
            "key_exprs": sorted(set(on)),
        }

    if holder.role == ROUTER:
        # Another router of the cell passes on what its own rules have let in.
        everything = f"{keys.everything}"
        for flow in (INGRESS, EGRESS):
            yield rule(f"passes on, {flow}", _EVERY_MESSAGE, flow, [everything])
        return
    rights = rights_of(holder.role, keys, holder.instance or ANY)
    # Questions may be put to all instances, or to all kinds of process, at once.
    asked_of = [
        keys.rpc(service, ANY, verb.name)
        for verb in VERBS
        if rights.answers and (not verb.services or holder.role in verb.services)
        for service in (holder.role, ANY)
    ]
    for what, messages, flow, on in (
        ("says", ["put", "delete"], INGRESS, rights.says),
        ("finds who hears", ["declare_subscriber"], EGRESS, rights.says),
        ("asks to hear", ["declare_subscriber"], INGRESS, rights.hears),
        ("hears", ["put", "delete"], EGRESS, rights.hears),
        ("answers", ["declare_queryable", "reply"], INGRESS, rights.answers),
        ("is asked", ["query"], EGRESS, asked_of),
        ("asks", ["query"], INGRESS, rights.asks),
        ("is answered", ["reply", "declare_queryable"], EGRESS, rights.asks),
        ("is there", ["liveliness_token"], INGRESS, rights.announces),
        (
            "looks for",
            ["declare_liveliness_subscriber", "liveliness_query"],
            INGRESS,
            rights.watches,
        ),
        ("sees", ["liveliness_token", "reply"], EGRESS, rights.watches),
    ):
        if on:
            yield rule(what, messages, flow, on)


_EVERY_MESSAGE = [
    "put",
    "delete",
    "query",
    "reply",
    "declare_subscriber",
    "declare_queryable",
    "liveliness_token",
    "liveliness_query",
    "declare_liveliness_subscriber",
]
