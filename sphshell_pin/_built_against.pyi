"""Written by CMake beside the core: the versions of the libraries that it was compiled against."""

VERSIONS: dict[str, str]
