"""A survey as a folder or zip for an archive: data, workflow, scene, pictures, versions, and an
RO-Crate description.

`unpacked` and `complaints` are the other way: what `survey verify` checks of a bundle before it
verifies the data.

Source: RO-Crate Metadata Specification 1.1 (https://w3id.org/ro/crate/1.1), with a CreateAction as
provenance.
"""

import contextlib
import hashlib
import json
import re
import shutil
import tempfile
import tomllib
import zipfile
from pathlib import Path

import survey
from survey.errors import BadInput, Damaged
from survey.file import reading
from survey.file.disk import check_folder, digest_of, refused, write_atomically
from survey.wording import plain, short

CRATE = "ro-crate-metadata.json"
CONTEXT, PROFILE = "https://w3id.org/ro/crate/1.1/context", "https://w3id.org/ro/crate/1.1"
KINDS = {
    ".nc": "application/x-netcdf", ".toml": "application/toml", ".py": "text/x-python", ".png": "image/png",
    ".pdf": "application/pdf", ".md": "text/markdown", ".txt": "text/plain", ".sha256": "text/plain",
    ".cert": "application/json",
}  # fmt: skip
PACKAGES = {
    "survey": "stability-survey",
    "numba": "numba",
    "llvmlite": "llvmlite",
    "numpy": "numpy",
}
OTHERS = {
    ".7z",
    ".bz2",
    ".gz",
    ".html",
    ".json",
    ".nc",
    ".pdf",
    ".png",
    ".rar",
    ".tar",
    ".tgz",
    ".toml",
    ".xz",
}
FILES, RATIO, SPARE = 1000, 1032, 2**20  # of a bundle; the largest compression ratio of deflate
MOST = 2**26  # characters of the description


def write(path, output, author="", license_url=""):
    """Write the bundle of the survey in the file `path` to `output`, a zip or else a folder;
    returns its files' names.

    Raises BadInput if `output` exists.
    """
    path, output = Path(path), Path(output)
    if output.exists():
        raise BadInput(f"{output}: it exists; name another folder or .zip file with -o")
    check_folder(output)
    if output.suffix.lower() in OTHERS:
        raise BadInput(
            f"{output}: a bundle is a .zip file or a folder; name one, such as {output.with_suffix('.zip')}"
        )
    if license_url and "://" not in license_url:
        raise BadInput(f"--license {license_url!r}: give the address of the licence, such as "
                       "https://creativecommons.org/licenses/by/4.0/")  # fmt: skip
    ds = reading.load(path)
    with refused(output), tempfile.TemporaryDirectory(prefix=".bundle-", dir=output.parent) as made:
        folder = Path(made) / output.stem
        folder.mkdir()
        _fill(folder, path, ds)
        files = sorted(entry.name for entry in folder.iterdir())
        described = _described(folder, files, ds, path.name, author, license_url)
        (folder / CRATE).write_text(json.dumps(described, indent=1) + "\n", encoding="utf-8")
        files.append(CRATE)
        if output.suffix == ".zip":
            write_atomically(output, lambda file: _zipped(folder, files, file))
        else:
            folder.rename(output)
    return files


def _fill(folder, path, ds):
    """Copy and draw what belongs to the survey."""
    shutil.copyfile(path, folder / path.name)
    with open(path, "rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    digest_of(folder / path.name).write_text(f"{digest}  {path.name}\n", encoding="utf-8")
    text = str(ds.attrs.get("workflow", ""))
    if ds.attrs.get("scene_text"):
        text = _with_scene(folder, text, ds)
    (folder / "workflow.toml").write_text(text, encoding="utf-8")
    if "proof_certificate" in ds.attrs:
        certificate = path.parent / Path(str(ds.attrs["proof_certificate"])).name
        if not certificate.is_file():
            raise BadInput(
                f"bundle: {certificate.name}, the proof's certificate, is not beside {path}; copy it there"
            )
        with open(certificate, "rb") as file:
            if hashlib.file_digest(file, "sha256").hexdigest() != str(ds.attrs.get("proof_sha256")):
                raise BadInput(f"bundle: {short(certificate.name)} beside {path} is not the certificate of its proof "
                               "(sha256); copy that one there")  # fmt: skip
        shutil.copyfile(certificate, folder / certificate.name)
    (folder / "requirements.txt").write_text(_requirements(ds.attrs), encoding="utf-8")
    pictures = _pictures(folder, path, ds)
    (folder / "README.md").write_text(_readme(path.name, ds, pictures), encoding="utf-8")


def _with_scene(folder, text, ds):
    """Write the scene's file, and return the workflow with its name, where it was a path."""
    name = Path(str(ds.attrs["scene"])).name
    if not re.fullmatch(r"[\w.-]+\.py", name):
        raise BadInput(
            f"bundle: the scene {short(ds.attrs['scene'])} is not a file; write it to a .py file, and run that"
        )
    (folder / name).write_text(str(ds.attrs["scene_text"]), encoding="utf-8")
    given = str(tomllib.loads(text).get("scene", name))
    if given == name:
        return text
    found = re.sub(
        r"(?m)^scene\s*=\s*(?:\"[^\"\n]*\"|'[^'\n]*')", f'scene = "{name}"', text, count=1
    )
    if tomllib.loads(found).get("scene") != name:
        raise BadInput(
            'bundle: the workflow names its scene in an unusual way; write it as scene = "FILE.py"'
        )
    return found


def _requirements(attrs):
    """The versions that computed the data, for pip."""
    versions = [(pip, attrs.get(f"version_{name}")) for name, pip in PACKAGES.items()]
    return "".join(f"{pip}=={plain(str(version), 40)}\n" for pip, version in versions if version)


def _pictures(folder, path, ds):
    """Draw the figures that the workflow asks for, else the verdict; the names of their files."""
    from survey.show import figures

    output = tomllib.loads(str(ds.attrs.get("workflow", ""))).get("output", {})
    wanted = [name for name in output.get("figures", ()) if name in ds] or [
        name for name in ("verdict",) if name in ds
    ]
    drawn = []
    for name in wanted:
        target = folder / f"{path.stem}_{name}.png"
        try:
            figures.save(ds, target, name)
        except BadInput:  # not a map
            continue
        drawn.append(target.name)
    return drawn


def _readme(name, ds, pictures):
    """What is in the bundle, how it is verified, and how the data are computed again."""
    attrs = ds.attrs
    title = plain(str(attrs.get("title", name)), 300)

    def said(key):
        return plain(str(attrs.get(key, "unknown")), 60)

    lines = [
        f"# {title}", "",
        f"Computed by survey {said('version_survey')} with Python {said('version_python')}, {said('date_created')}. "
        "Every value has an error bar.", "",
        f"- `{name}`: the data, netCDF 4 (`xarray.open_dataset`), and its digest",
        "- `workflow.toml`: the workflow", "- `requirements.txt`: the versions that computed the data",
        *[f"- `{picture}`: a picture" for picture in pictures],
        f"- `{CRATE}`: this description for machines (RO-Crate 1.1), with the sha256 of each file", "",
        "Verify all of it: `survey verify FOLDER` (or the .zip). Compute the data again, to the same bits with the "
        "same versions on the same kind of processor: `pip install -r requirements.txt`, then `survey run "
        "workflow.toml -o again.nc` in this folder.",
    ]  # fmt: skip
    if "scene_text" in attrs:
        scene = Path(str(attrs["scene"])).name
        lines += ["", f"The scene is the Python file `{scene}`: read it before you run it."]
    return "\n".join(lines) + "\n"


def _described(folder, files, ds, data, author, license_url):
    """The RO-Crate's description of the folder."""
    attrs = ds.attrs
    title = plain(str(attrs.get("title", data)), 300)
    date = plain(str(attrs.get("date_created", "")), 40)
    entities = []
    for name in files:
        with open(folder / name, "rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        entities.append({
            "@id": name, "@type": "File", "name": name, "contentSize": str((folder / name).stat().st_size),
            "encodingFormat": KINDS.get(Path(name).suffix, "application/octet-stream"), "sha256": digest,
        })  # fmt: skip
    version = plain(str(attrs.get("version_survey", survey.__version__)), 40)
    inputs = [name for name in files if name.endswith((".toml", ".py", ".txt"))]
    outputs = [name for name in files if name not in inputs and name != "README.md"]
    root = {
        "@id": "./", "@type": "Dataset", "name": title, "datePublished": date[:10],
        "description": plain(str(attrs.get("summary", title)), 1000),
        "keywords": plain(str(attrs.get("keywords", "")), 300),
        "license": {"@id": license_url} if license_url else "not stated", "hasPart": [{"@id": name} for name in files],
        "mentions": {"@id": "#run"},
    }  # fmt: skip
    action = {
        "@id": "#run", "@type": "CreateAction", "name": f"survey run: {title}", "endTime": date,
        "instrument": {"@id": "#survey"}, "object": [{"@id": name} for name in inputs],
        "result": [{"@id": name} for name in outputs],
        "description": ", ".join(f"{key} {plain(str(attrs.get(key, 'unknown')), 200)}"
                                 for key in ("scene", "commit", "kernel_hash", "cpu")),
    }  # fmt: skip
    program = {"@id": "#survey", "@type": "SoftwareApplication", "name": "survey", "version": version,
               "softwareVersion": version}  # fmt: skip
    further = []
    if author:
        root["author"] = action["agent"] = {"@id": "#author"}
        further.append({"@id": "#author", "@type": "Person", "name": author})
    if license_url:
        further.append({"@id": license_url, "@type": "CreativeWork", "name": license_url})
    head = {
        "@id": CRATE,
        "@type": "CreativeWork",
        "conformsTo": {"@id": PROFILE},
        "about": {"@id": "./"},
    }
    return {"@context": CONTEXT, "@graph": [head, root, *entities, action, program, *further]}


def _zipped(folder, files, file):
    """Write the folder as a zip; the same survey gives the same bytes, except for pictures."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in files:
            member = zipfile.ZipInfo(f"{folder.name}/{name}", (1980, 1, 1, 0, 0, 0))
            member.compress_type, member.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            with (
                open(folder / name, "rb") as source,
                archive.open(member, "w", force_zip64=True) as target,
            ):
                shutil.copyfileobj(source, target, 2**20)


def is_bundle(path):
    """Is there a bundle at `path`: a folder with a description, or a zip?"""
    path = Path(path)
    return (
        (path / CRATE).is_file() if path.is_dir() else path.is_file() and zipfile.is_zipfile(path)
    )


@contextlib.contextmanager
def unpacked(path):
    """The folder of the bundle at `path`; a zip is unpacked beside nothing, and removed again.
    Raises Damaged.
    """
    path = Path(path)
    if path.is_dir():
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="survey-bundle-") as folder:
        try:
            with zipfile.ZipFile(path) as archive:
                _extract(archive, Path(folder), path)
        except (zipfile.BadZipFile, EOFError, OSError, NotImplementedError, RuntimeError) as error:
            raise Damaged(
                f"{path}: cannot be unpacked ({error}); ask its author for an intact copy"
            ) from None
        yield Path(folder)


def _extract(archive, folder, path):
    """The members of a bundle, which all lie in one folder, as files; anything else is refused."""
    members = [member for member in archive.infolist() if not member.is_dir()]
    if len(members) > FILES:
        raise Damaged(f"{path}: it has {len(members):,} files; no bundle has more than {FILES:,}")
    for member in members:
        parts = member.filename.split("/")
        if len(parts) > 2 or not all(re.fullmatch(r"\w[\w .+-]*", part) for part in parts):
            raise Damaged(f"{path}: it contains {short(member.filename)!r}, which no bundle does")
        if member.file_size > RATIO * member.compress_size + SPARE:
            raise Damaged(f"{path}: {short(member.filename)} declares more bytes than it can hold")
        with archive.open(member) as source, open(folder / parts[-1], "xb") as target:
            shutil.copyfileobj(source, target, 2**20)


def complaints(folder):
    """(sentences on the faults of the bundle, the path of its data); raises Damaged where it has no
    description.
    """
    folder, described = Path(folder), folder / CRATE
    try:
        if described.stat().st_size > MOST:
            raise ValueError("it is too long")
        graph = json.loads(described.read_text(encoding="utf-8"))["@graph"]
        entities = {entity["@id"]: entity for entity in graph}
        parts = [str(part["@id"]) for part in entities["./"]["hasPart"]]
        digests = {name: str(entities[name]["sha256"]) for name in parts}
        context = entities[CRATE]["conformsTo"]["@id"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise Damaged(
            f"{CRATE}: it does not describe the bundle ({error!r}); ask its author for an intact copy"
        ) from None
    wrong = (
        []
        if context == PROFILE
        else [f"{CRATE}: it conforms to {short(context)}, not to {PROFILE}"]
    )
    there = {entry.name for entry in folder.iterdir()} - {CRATE}
    wrong += [
        f"{short(name)}: the bundle lists this file, but it is missing"
        for name in parts
        if name not in there
    ]
    wrong += [
        f"{short(name)}: the bundle does not list this file" for name in sorted(there - set(parts))
    ]
    for name in sorted(there & set(parts)):
        with open(folder / name, "rb") as file:
            if hashlib.file_digest(file, "sha256").hexdigest() != digests[name]:
                wrong.append(f"{short(name)}: its bits differ from the sha256 in {CRATE}")
    data = [name for name in parts if name.endswith(".nc") and name in there]
    if len(data) != 1:
        raise Damaged(f"the bundle must hold one netCDF file; it has {len(data)}")
    return wrong + _unlike(folder, data[0]), folder / data[0]


def _unlike(folder, data):
    """Does the workflow say what the data were computed from, and is the scene's text theirs?"""
    attrs = reading.attributes_of(folder / data)
    wrong = []
    try:
        asked = tomllib.loads((folder / "workflow.toml").read_text(encoding="utf-8"))
        held = tomllib.loads(str(attrs.get("workflow", "")))
    except (OSError, ValueError, RecursionError) as error:
        return [f"workflow.toml: it cannot be compared with the data's ({short(error)})"]
    if "scene_text" in attrs:
        name = Path(str(attrs["scene"])).name
        asked["scene"] = held["scene"] = name
        scene = folder / name
        if not scene.is_file() or scene.read_text(encoding="utf-8") != str(attrs["scene_text"]):
            wrong.append(f"{short(name)}: it is not the scene that the data were computed from")
    if asked != held:
        wrong.append("workflow.toml: it is not the workflow that the data were computed from")
    return wrong
