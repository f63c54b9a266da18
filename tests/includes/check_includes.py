#!/usr/bin/env python3
"""Includes point one way: check_includes.py SRC [--expect N]

Reads every C++ file under SRC/porthole and prints each include that its folder may not have,
each library header outside the one folder that may use it, and each place that prints or
exits. Exits 1 when there is any; with --expect, when there are not exactly N.
"""

import argparse
import pathlib
import re
import sys

# Folder -> folders of ours that it may include. "." is src/porthole itself: the whole flow.
FOLDERS = {
    "base": {"base"},
    "scene": {"base", "scene"},
    "trace": {"base", "scene", "trace"},
    "hole": {"base", "hole"},
    "render": {"base", "scene", "trace", "render"},
    "io": {"base", "scene", "io"},
    ".": {".", "base", "scene", "trace", "hole", "render"},
}
# Library -> the only folders that may see its headers.
LIBRARIES = {
    r"embree\d?/": {"trace"},
    r"nlohmann/": {"io", "."},  # "." writes the report
    r"(draco|webp)/|meshoptimizer|png\.h|turbojpeg\.h|jpeglib\.h": {"io"},
}
# What a test (x_test.cpp) may include besides: it may read a model. It may print, too, and
# use tests/support.
TEST_FOLDERS = {"io"}

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
PRINTS = re.compile(r"\bstd::(cout|cerr|clog|exit|_Exit|quick_exit|puts|printf|fprintf\s*\(\s*std(out|err))\b"
                    r"|(?<![\w:.>])(printf|puts|exit|_exit)\s*\(|#\s*include\s*<iostream>")


def faults_of(path, root):
    """Yields (line number, what is wrong) of one file."""
    folder = path.relative_to(root).parts[0] if len(path.relative_to(root).parts) > 1 else "."
    allowed = FOLDERS.get(folder)
    if allowed is None:
        yield 1, f"folder {folder} has no rule; add it to {pathlib.Path(__file__).name}"
        return
    is_test = path.stem.endswith("_test")
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        code = line.split("//")[0] if not INCLUDE.match(line) else line
        if not is_test and PRINTS.search(code):
            yield number, "the library does not print or exit"
        match = INCLUDE.match(line)
        if not match:
            continue
        name = match[2]
        if name.startswith("porthole/"):
            parts = pathlib.PurePosixPath(name).parts
            target = parts[1] if len(parts) > 2 else "."
            if target not in allowed | (TEST_FOLDERS if is_test else set()):
                yield number, f"{folder} must not include {name}"
            elif not (root.parent / name).is_file():
                yield number, f"{name} does not exist"
        elif match[1] == '"' and not (path.parent / name).is_file() and not (is_test and name.startswith("support/")):
            yield number, f'"{name}" is not beside this file; write "porthole/..."'
        for pattern, users in LIBRARIES.items():
            if re.match(pattern, name) and folder not in users:
                yield number, f"{folder} must not include {name}: only {', '.join(sorted(users))} does"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("source", type=pathlib.Path)
    parser.add_argument("--expect", type=int, default=0)
    arguments = parser.parse_args()
    root = arguments.source / "porthole"
    files = sorted(p for p in root.rglob("*") if p.suffix in (".h", ".cpp"))
    if not files:
        sys.exit(f"no C++ files under {root}")
    faults = [(path, number, text) for path in files for number, text in faults_of(path, root)]
    for path, number, text in faults:
        print(f"{path}:{number}: {text}")
    print(f"{len(files)} files, {len(faults)} faults")
    sys.exit(0 if len(faults) == arguments.expect else 1)


if __name__ == "__main__":
    main()
