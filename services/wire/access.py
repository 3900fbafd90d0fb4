"""Who may say, hear, ask and answer what: Zenoh's access control, made from the topic table.

A role is the common name of a certificate, ``<role>.<robot>``. Every process holds every other
one to the same rules; what no rule allows is dropped before Python sees it. Zenoh's terms: "in"
is what comes from the other side, "out" is what we send it; a subscriber or queryable has to be
announced to the other side as well, or nothing is ever sent.
"""

from __future__ import annotations

from typing import Any

from services.topics import CONSOLE, PROCESSES, RECORDER, SERVICES, TOPICS, key, request_key

OPERATOR = "operator"
"""A person who may ask for anything and hear everything."""
WATCHER = "watcher"
"""A person who may hear everything."""
PEOPLE = (OPERATOR, WATCHER)
ROLES = (*PROCESSES, CONSOLE, *PEOPLE)


def common_name(robot: str, role: str) -> str:
    """Common name of the certificate of a role: one authority may serve several robots."""
    return f"{role}.{robot}"


def says(robot: str, role: str) -> list[str]:
    """Keys a role may publish: what it owns."""
    return [key(robot, topic) for topic in TOPICS.values() if topic.owner == role]


def hears(robot: str, role: str) -> list[str]:
    """Keys a role may subscribe to."""
    return [
        key(robot, topic)
        for topic in TOPICS.values()
        if role in topic.readers or role in (RECORDER, CONSOLE, *PEOPLE)
    ]


def asks(robot: str, role: str) -> list[str]:
    """Keys a role may send requests to."""
    return [request_key(robot, "*", "*")] if role in (OPERATOR, CONSOLE) else []


def answers(robot: str, role: str) -> list[str]:
    """Keys a role may answer requests on: its own."""
    return [request_key(robot, role, "*")] if role in SERVICES else []


# what a role may do, seen by whoever is connected to it: (name, keys, direction to messages)
_RIGHTS = (
    ("says", says, {"ingress": ["put"], "egress": ["declare_subscriber"]}),
    ("hears", hears, {"ingress": ["declare_subscriber"], "egress": ["put"]}),
    ("asks", asks, {"ingress": ["query"], "egress": ["declare_queryable", "reply"]}),
    ("answers", answers, {"ingress": ["declare_queryable", "reply"], "egress": ["query"]}),
)
_EVERYTHING = [
    "put",
    "declare_subscriber",
    "query",
    "reply",
    "declare_queryable",
]


def access_control(robot: str) -> dict[str, Any]:
    """Zenoh's ``access_control`` of every process of a robot: default deny.

    Processes of one host meet on unix sockets in a directory that is closed to other users; whoever
    can open those is taken to be us, as without this profile.
    """
    rules: list[dict[str, Any]] = [
        {
            "id": "this host",
            "permission": "allow",
            "flows": ["ingress", "egress"],
            "messages": _EVERYTHING,
            "key_exprs": [f"{robot}/**"],
        }
    ]
    policies = [{"rules": ["this host"], "subjects": ["this host"]}]
    subjects: list[dict[str, Any]] = [{"id": "this host", "link_protocols": ["unixsock-stream"]}]
    for role in ROLES:
        mine = []
        for name, keys_of, flows in _RIGHTS:
            keys = keys_of(robot, role)
            for flow, messages in flows.items() if keys else ():
                mine.append(f"{role} {name} ({flow})")
                rules.append(
                    {
                        "id": mine[-1],
                        "permission": "allow",
                        "flows": [flow],
                        "messages": messages,
                        "key_exprs": keys,
                    }
                )
        subjects.append(
            {
                "id": role,
                "cert_common_names": [common_name(robot, role)],
                "link_protocols": ["tls", "quic"],
            }
        )
        policies.append({"rules": mine, "subjects": [role]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }
