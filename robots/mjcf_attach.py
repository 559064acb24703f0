"""Models that an MJCF attaches, put in their places."""

import os
import xml.etree.ElementTree as ET
from pathlib import Path

from sphshell_pin.base.regular_file import read_bytes
from sphshell_pin.robots.description import DEEPEST, check_size, parsed
from sphshell_pin.robots.mjcf_includes import MOST_FILES, MOST_INCLUDED, include

# Attributes that name something of the model, all of which get the prefix.
_NAMES = {"name", "mesh", "hfield", "material", "texture", "target", "tendon", "objname", "refname"}
_NAMES |= {f"{one}{k}" for one in ("body", "joint", "geom", "site") for k in ("", "1", "2")}
# Of a model that is attached these stay out.
_OWN = {"compiler", "default", "worldbody", "asset", "keyframe", "option", "size", "visual"}
_OWN |= {"statistic", "custom", "extension"}
_FOLDERS = {"meshdir", "texturedir", "assetdir", "strippath", "discardvisual"}


def attach(root: ET.Element, open_files: list[Path], sizes: list[int] | None = None) -> None:
    """Put the bodies of models that `root` names in the place of <attach>, with all they need.

    Their default classes get names of their own. ValueError where the model cannot be had, or reads
    angles in another way, or where defaults without a class would act on it.
    """
    sizes = [] if sizes is None else sizes
    models = {one.get("name"): one for one in root.findall("asset/model")}
    for holder in [one for one in root.iter() if one.find("attach") is not None]:
        for k in range(len(holder) - 1, -1, -1):
            if holder[k].tag == "attach":
                holder[k : k + 1] = _parts(root, holder[k], models, open_files, sizes)
    for asset in root.findall("asset"):
        for one in asset.findall("model"):
            asset.remove(one)


def _parts(
    root: ET.Element,
    stated: ET.Element,
    models: dict[str | None, ET.Element],
    open_files: list[Path],
    sizes: list[int],
) -> list[ET.Element]:
    """Return the bodies that an <attach> stands for; their classes and meshes go to `root`."""
    name, prefix = stated.get("model", ""), stated.get("prefix", "")
    if name not in models:
        raise ValueError(f"it attaches the model '{name}', which no <asset> names")
    path = open_files[-1].parent / models[name].get("file", "")
    if not os.path.isfile(path):
        raise ValueError(f"it attaches {models[name].get('file')}, which is not there")
    text = read_bytes(path, MOST_INCLUDED)
    sizes.append(len(text))
    if len(open_files) > DEEPEST or len(sizes) > MOST_FILES or sum(sizes) > MOST_INCLUDED:
        raise ValueError("it attaches models that attach each other, or too many")
    check_size(text)
    model = parsed(text)
    files = [*open_files, path.resolve()]
    include(model, files[-1:], sizes)
    attach(model, files, sizes)
    ways = [_compiler(one) for one in (root, model)]
    alike = {key: value for key, value in ways[0].items() if key not in _FOLDERS}
    if alike != {key: value for key, value in ways[1].items() if key not in _FOLDERS}:
        raise ValueError(f"it attaches {path.name}, whose <compiler> differs from its own")
    if any(one.tag != "default" for top in root.findall("default") for one in top):
        raise ValueError(f"it attaches {path.name}: its <default> without a class would act there")
    own, meshes = f"{prefix}{name}/{len(sizes)}/", ways[1].get("meshdir", ways[1].get("assetdir"))
    for one in model.iter("mesh"):
        if "file" in one.attrib:
            one.set("name", one.get("name", Path(one.attrib["file"]).stem))
            one.set("file", str(path.absolute().parent / (meshes or "") / one.attrib["file"]))
    given = root.find("default")
    defaults = ET.SubElement(root, "default") if given is None else given
    for top in model.findall("default") or [ET.SubElement(model, "default")]:
        top.set("class", top.get("class", "main"))
        defaults.append(top)
    for one in model.iter():
        if one.tag == "mesh" and "class" not in one.attrib and "file" in one.attrib:
            one.set("class", "main")
        for key in one.attrib:
            if key in ("class", "childclass"):
                one.set(key, own + one.attrib[key])
            elif key in _NAMES:
                one.set(key, prefix + one.attrib[key])
    for section in model:
        if section.tag == "asset" or section.tag not in _OWN:
            root.append(section)
    wanted, body = (
        [one for world in model.findall("worldbody") for one in world],
        stated.get("body"),
    )
    if body:
        wanted = [one for one in model.iter("body") if one.get("name") == prefix + body]
    frame = ET.Element("frame", childclass=f"{own}main")
    frame.extend(wanted)
    return [frame]


def _compiler(model: ET.Element) -> dict[str, str]:
    return {key: value for one in model.findall("compiler") for key, value in one.items()}
