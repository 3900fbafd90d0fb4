"""``steadyhand keys``: certificates for the hosts of a robot and for its people."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from services.cli.common import console, fail, writing


def keys(
    hosts: Annotated[Path, typer.Argument(help="Hosts file: a path, or a name: three.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for authority and keys.")],
    days: Annotated[float, typer.Option(min=1, help="How long the certificates are valid.")] = 365,
) -> None:
    """Make, or renew, the certificates of every host in a hosts file, and of people.

    An authority that is already in the folder signs again. Its key stays where it is made; each
    host is given its own folder, people are given 'people'.
    """
    from deploy.host_file import load_hosts
    from deploy.tomlfile import BadFile
    from services.wire.keys import make_keys

    try:
        places = load_hosts(hosts)
    except BadFile as error:
        fail(str(error), 2)
    about = {name: (host.address, host.services) for name, host in places.host.items()}
    with writing():
        made = make_keys(out, places.robot, about, days)
    for folder in made:
        console.print(f"{folder}: {', '.join(sorted(p.stem for p in folder.glob('*.key')))}")
    console.print(
        f"Copy each folder to its host; {out / 'authority.key'} stays here.", highlight=False
    )
