"""The process in which a xacro file is expanded: with limits, and without files to write.

The answer is JSON: a xacro file is code, so nothing that comes from its process is unpickled.
"""

import contextlib
import io
import json
import re
import resource
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.dom.minidom import Element

from sphshell_pin.base.limits import limit_memory
from sphshell_pin.robots.packages import Folders, stated_source
from sphshell_pin.robots.xacro_expressions import install

MOST_TEXT, MOST_SAID = 100_000_000, 100_000
"""Characters of the URDF, and of xacro's warnings."""


def serve(source: int, target: int) -> None:
    """Expand the file that is named on one pipe, and write the answer to the other."""
    with open(source) as pipe:
        request = json.load(pipe)
    time = int(request["time_limit"])
    for kind, most in (
        (resource.RLIMIT_CPU, time),
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_FSIZE, 0),
        (resource.RLIMIT_NPROC, 0),
    ):
        with contextlib.suppress(OSError, ValueError):  # a lower limit is set already
            resource.setrlimit(kind, (most, most))
    limit_memory(request["memory_limit"])
    file = Path(request["file"])
    sys.stderr = said = io.StringIO()  # as long as the memory allows
    answer: dict[str, str]
    try:
        folders = Folders.of(file, request["folders"])
        urdf, left_out = _expanded(file, folders, request["arguments"])
        if len(urdf) > MOST_TEXT:
            raise ValueError(f"it expands to more than {MOST_TEXT / 1e6:g} MB")
        answer = {"urdf": urdf, "left_out": left_out, "said": said.getvalue()[:MOST_SAID]}
    except MemoryError:
        answer = {"fault": "memory"}
    except ValueError as error:
        answer = {"fault": "file", "reason": str(error)}
    with open(target, "w") as pipe:
        json.dump(answer, pipe)


def _expanded(file: Path, folders: Folders, arguments: Mapping[str, str]) -> tuple[str, str]:
    """Return the URDF, and which macros are left out; ValueError with the reason of a fault."""
    import xacro
    from xacro import substitution_args

    missing, calls, renamed = _with_found_includes(xacro, folders)

    def find(name: str) -> str:
        folder = folders.package(name) or renamed.get(name)
        if folder is None:
            raise substitution_args.ArgException(_absent(name, file, folders))
        return str(folder)

    # xacro asks ament alone, which few machines have. $(eval find('name')) looks in the dictionary.
    substitution_args._eval_find = substitution_args._eval_dict["find"] = find
    _with_former_tags(xacro)
    try:
        install(xacro, substitution_args)
        document = _processed(xacro, file, arguments)
        if missing and not _is_whole(document.documentElement, moves=bool(calls)):
            raise ValueError(_absent(missing[0], file, folders))
    except Exception as error:  # of the package xacro, which raises what happens to come up
        causes = list(_causes(error))
        if any(isinstance(one, MemoryError) for one in causes):
            raise MemoryError from None
        if any(isinstance(one, RecursionError) for one in causes):
            raise ValueError("its files, macros or elements are nested too deeply") from None
        reason = _reason(error, causes) or type(error).__name__
        if missing and "there is no package" not in reason:
            reason = f"{_absent(missing[0], file, folders)} ({reason})"
        where = Path((xacro.filestack or [file])[-1]).name
        of = f" (in {where})" if where != file.name else ""
        raise ValueError(f"xacro cannot expand it{of}: {reason}") from None
    called = ", ".join(dict.fromkeys(calls))
    left_out = f"without {called}: {_absent(missing[0], file, folders)}" if calls else ""
    return str(document.toxml()), left_out


def _absent(name: str, file: Path, folders: Folders) -> str:
    """Say that a package is nowhere, and what to do."""
    return (
        f"there is no package '{name}' in {folders.searched()}: give the folder above it "
        "with --package-dir, or package_dirs in a scenario or in Python"
        + stated_source(file.resolve().parent, name)
    )


def _is_whole(root: Element, *, moves: bool) -> bool:
    """Whether a robot has links, all that its joints name, and if it `moves` a joint that does."""
    kinds = {one.getAttribute("type") for one in root.getElementsByTagName("joint")} | {"fixed"}
    links = {one.getAttribute("name") for one in root.getElementsByTagName("link")} - {""}
    ends = [one for tag in ("parent", "child") for one in root.getElementsByTagName(tag)]
    named = {one.getAttribute("link") for one in ends}
    return bool(links) and named <= links | {""} and (not moves or kinds > {"fixed"})


def _processed(xacro: Any, file: Path, arguments: Mapping[str, str]) -> Any:
    """Return the document, where that fails without what is for simulators and drivers.

    Older versions of xacro knew all properties of a file from its top.
    """
    try:
        return xacro.process_file(str(file), mappings=dict(arguments))
    except xacro.XacroException as error:
        if "is not defined" not in str(error):
            parse = xacro.parse
            xacro.parse = lambda *given: _of_robot(parse(*given))
            try:
                return xacro.process_file(str(file), mappings=dict(arguments))
            except xacro.XacroException:
                raise error from None
        xacro.init_stacks(str(file))
        document = xacro.parse(None, str(file))
        root = document.documentElement
        for one in reversed(root.getElementsByTagName("xacro:property")):
            if one.parentNode is root:
                root.insertBefore(one, root.firstChild)
        xacro.process_doc(document, mappings=dict(arguments))
        return document


def _of_robot(document: Any) -> Any:
    """Return a document without elements that state nothing of the robot itself."""
    for tag in ("gazebo", "ros2_control"):
        for one in document.getElementsByTagName(tag):
            one.parentNode.removeChild(one)
    return document


def _with_found_includes(
    xacro: Any, folders: Folders
) -> tuple[list[str], list[str], dict[str, Path]]:
    """Let xacro include files from where they are, and leave out those of packages that are not.

    Returned are the packages that are missing, the calls of their macros, which are left out too
    (sensors, mostly), and by package folders of another name that have its files.
    """
    missing, calls, renamed = list[str](), list[str](), dict[str, Path]()
    included, call = xacro.get_include_files, xacro.handle_macro_call

    def include(name: str, symbols: object) -> Iterator[str]:
        package = re.match(r"\$\(find ([\w-]+)\)[/\\]?(.*)", name)
        if package is not None and folders.package(package[1]) is None:
            folder = folders.holding(package[2])
            if folder is None:
                if package[1] not in missing:
                    missing.append(package[1])
                    xacro.warning(
                        f"without {name.rpartition('/')[2]}: there is no package '{package[1]}' "
                        "(see --package-dir)"
                    )
                return
            renamed[package[1]] = folder
        for file in included(name, symbols):
            yield str(folders.moved(file) or file)

    def handle(node: Any, macros: Any, symbols: object) -> object:
        if missing and node.tagName.startswith("xacro:") and node.tagName != "xacro:call":
            try:
                xacro.resolve_macro(node.tagName[6:], macros, symbols)
            except KeyError:
                if node.parentNode.tagName != "visual":  # there it is a color
                    calls.append(node.tagName)
                xacro.replace_node(node, by=None)
                return True
        return call(node, macros, symbols)

    xacro.get_include_files, xacro.handle_macro_call = include, handle
    return missing, calls, renamed


def _with_former_tags(xacro: Any) -> None:
    """Let xacro read its tags without the prefix `xacro:`, as its versions before 2020 did."""
    read, call = xacro.parse, xacro.handle_macro_call
    tags, macros = ("macro", "include", "property", "if", "unless", "insert_block"), set[str]()

    def parse(text: str | None, file: str | None = None) -> Any:
        document = read(text, file)
        named = [one for one in document.getElementsByTagName("macro") if one.hasAttribute("name")]
        files = document.getElementsByTagName("include")
        if named or any(one.hasAttribute("filename") for one in files):
            of = Path(xacro.filestack[-1]).name
            xacro.warning(f"{of}: tags of xacro lack the prefix 'xacro:'")
            macros.update(one.getAttribute("name") for one in named)
            for tag in tags:
                for one in document.getElementsByTagName(tag):
                    one.tagName = one.nodeName = f"xacro:{tag}"
        return document

    def handle(node: Any, *given: object) -> object:
        if node.tagName in macros:
            node.tagName = f"xacro:{node.tagName}"
        return call(node, *given)

    xacro.parse, xacro.handle_macro_call = parse, handle


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    """Return an error, and what it was raised for: xacro wraps errors of nested properties."""
    while error is not None:
        yield error
        error = getattr(error, "exc", None) or error.__cause__ or error.__context__


def _reason(error: Exception, causes: Sequence[BaseException]) -> str:
    """Return what the package xacro says of an error: once, and without Python's classes."""
    said = " ".join(str(error).split())
    for cause in causes:
        told = " ".join(str(cause).split())
        if isinstance(cause, OSError):  # its text follows xacro's own sentence
            said = said.replace(f" {told}", "")
        said = said.replace(f"{type(cause)}: {told} ", "")
    # xacro says so of all that a substitution may fail for.
    return said.replace("Undefined substitution argument there is", "there is")
