"""Pack a folder of recordings as a Research Object Crate, a zip file for a data repository.

In RO-Crate 1.1, ``ro-crate-metadata.json`` describes every file. For recordings, it also contains the
excitation, the reason why the run ended, channels, units and software.
"""

import hashlib
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from mimetypes import guess_type
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile

from vibench.acquisition import RecordingError, open_recording
from vibench.acquisition.plan import present_word

from ..errors import InvalidRequest, NotEnoughData
from ._excerpt import TransferObserver, ignore_progress
from ._export import new_file

METADATA = "ro-crate-metadata.json"
CONTEXT = "https://w3id.org/ro/crate/1.1"
_CREATIVE_COMMONS = re.compile(
    r"creativecommons\.org/(?:licenses/(?P<kind>[a-z-]+)|publicdomain/zero)/?(?P<version>[\d.]*)"
)
_SCHEMES = ("https://", "http://")
HDF5_TYPE = "application/x-hdf5"
Entity = dict[str, Any]


@dataclass(frozen=True)
class CrateFacts:
    """Facts for the crate that are not in the folder."""

    licence: str
    """Address of the licence, such as ``https://creativecommons.org/licenses/by/4.0/``."""
    authors: tuple[str, ...] = ()
    title: str = ""
    """Title; the name of the folder if empty."""
    description: str = ""
    organisation: str = ""
    """Organisation that publishes the crate and to which the authors belong."""
    organisation_url: str = ""


def pack_folder(
    folder: Path,
    crate: Path,
    facts: CrateFacts,
    untrusted: Mapping[str, str],
    observer: TransferObserver = ignore_progress,
) -> tuple[Path, ...]:
    """Pack a folder and its description into a zip; return the packed files.

    Parameters
    ----------
    folder
        Folder of recordings with journals, reports and tables; it is not changed.
    crate
        The new zip file; an existing file is never overwritten.
    facts
        Licence, authors and their organisation, title.
    untrusted
        Reasons not to trust recordings, keyed by path relative to the folder, as ``verify_recordings`` of
        `vibench.acquisition.campaign` returns them. Such recordings are packed unchanged, with a remark.
    observer
        Receives the number of bytes packed since the last call.

    Raises
    ------
    NotEnoughData
        When the folder contains no recording.
    InvalidRequest
        When the licence or the organisation's page is not a web address, a link leads out of the folder, or
        the zip file exists or cannot be written.
    """
    _require_addresses(facts)
    files = (each for each in sorted(folder.rglob("*")) if each.is_file() and each != crate)
    paths = tuple(each for each in files if each.name != METADATA and each.suffix not in {".tmp", ".part"})
    outside = [each for each in paths if not each.resolve().is_relative_to(folder.resolve())]
    if outside:
        raise InvalidRequest(
            f"{outside[0]} is a link to {outside[0].resolve()}, outside of the folder; its target would also "
            "be published, so nothing was packed. Replace the link by a copy of the file, or remove the link"
        )
    entities = [_file_entity(path, folder, untrusted) for path in paths]
    if not any(each.get("encodingFormat") == HDF5_TYPE for each in entities):
        raise NotEnoughData(f"{folder} contains no recording; give the folder of a campaign")
    document = {
        "@context": f"{CONTEXT}/context",
        "@graph": [*_about(folder, facts, untrusted, entities), *entities],
    }
    with new_file(crate) as unfinished, ZipFile(unfinished, "x", ZIP_DEFLATED) as archive:
        archive.writestr(METADATA, json.dumps(document, indent=2, ensure_ascii=False))
        for path in paths:
            # Finished recordings are already compressed.
            kind = ZIP_STORED if path.suffix == ".h5" else ZIP_DEFLATED
            archive.write(path, path.relative_to(folder).as_posix(), compress_type=kind)
            observer(path.stat().st_size)
    return paths


def _require_addresses(facts: CrateFacts) -> None:
    if not facts.licence.startswith(_SCHEMES):
        raise InvalidRequest(
            f"{facts.licence!r} is not the address of a licence; nothing was packed. Give an address such as "
            "https://creativecommons.org/licenses/by/4.0/"
        )
    if facts.organisation_url and not facts.organisation:
        raise InvalidRequest(
            f"{facts.organisation_url} was given without the name of the organisation; nothing was packed. "
            "Give this name too"
        )
    if facts.organisation_url and not facts.organisation_url.startswith(_SCHEMES):
        raise InvalidRequest(
            f"{facts.organisation_url!r} is not the address of an organisation; nothing was packed. Give an "
            "address such as https://ror.org/03yrm5c26"
        )


def _about(
    folder: Path, facts: CrateFacts, untrusted: Mapping[str, str], entities: Sequence[Entity]
) -> Iterator[Entity]:
    """Return the entities of the crate, its licence, authors and organisation."""
    described = facts.description or "Recordings of vibro-impact shaker tests, made with vibench"
    warned = (f"{name} cannot be trusted ({why})" for name, why in untrusted.items())
    people = [{"@id": f"#author-{number}"} for number, _ in enumerate(facts.authors, 1)]
    publisher = {"@id": "#organisation"} if facts.organisation else None
    yield {
        "@id": METADATA,
        "@type": "CreativeWork",
        "conformsTo": {"@id": CONTEXT},
        "about": {"@id": "./"},
    }
    yield {
        "@id": "./",
        "@type": "Dataset",
        "name": facts.title or folder.resolve().name,
        "description": "; ".join((described, *warned)),
        "datePublished": datetime.now(UTC).date().isoformat(),
        "license": {"@id": facts.licence},
        **({"author": _single_or_list(people)} if people else {}),
        **({"publisher": publisher} if publisher else {}),
        "hasPart": _single_or_list([{"@id": each["@id"]} for each in entities]),
    }
    yield {
        "@id": facts.licence,
        "@type": "CreativeWork",
        "name": _licence_name(facts.licence),
        "description": "The licence of this dataset",
    }
    for person, name in zip(people, facts.authors, strict=True):
        yield {
            **person, "@type": "Person", "name": name,
            **({"affiliation": publisher} if publisher else {}),
        }  # fmt: skip
    if publisher:
        url = {"url": facts.organisation_url} if facts.organisation_url else {}
        yield {**publisher, "@type": "Organization", "name": facts.organisation, **url}


def _single_or_list(entities: list[Entity]) -> list[Entity] | Entity:
    """Return a list of one entity as that entity alone, as RO-Crate 1.1 recommends (compacted JSON-LD)."""
    return entities[0] if len(entities) == 1 else entities


def _licence_name(address: str) -> str:
    """Return the name of a Creative Commons licence ("CC BY 4.0"), otherwise the end of the address."""
    found = _CREATIVE_COMMONS.search(address)
    if found is None:
        return address.rstrip("/").rpartition("/")[2]
    kind = f"CC {found['kind'].upper()}" if found["kind"] else "CC0"
    return f"{kind} {found['version']}".rstrip()


def _file_entity(path: Path, folder: Path, untrusted: Mapping[str, str]) -> Entity:
    with path.open("rb") as file:
        checksum = hashlib.file_digest(file, "sha256").hexdigest()
    entity = {
        "@id": path.relative_to(folder).as_posix(),
        "@type": "File",
        "name": path.name,
        "contentSize": str(path.stat().st_size),
        "sha256": checksum,
        "encodingFormat": guess_type(path.name)[0] or "application/octet-stream",
    }
    if path.suffix != ".h5":
        return entity
    try:
        with open_recording(path) as recording:
            kind = present_word(recording.plan.get("excitation", {}).get("kind", "recording"))
            measured = "; ".join(f"{each.role} [{each.unit}]" for each in recording.channels)
            entity |= {
                "encodingFormat": HDF5_TYPE,
                "identifier": recording.recording_id,
                "dateCreated": recording.started_utc,
                "description": f"{kind}, {recording.origin.value}, {recording.duration_s:.6g} s at "
                f"{recording.sample_rate_hz:.6g} Hz; {recording.state.value}: {recording.reason}; {measured}",
            }
    except RecordingError as error:
        entity["description"] = f"Cannot be read as a recording: {error}"
    if why := untrusted.get(str(entity["@id"])):
        entity["description"] = f"Cannot be trusted ({why})"
    return entity
