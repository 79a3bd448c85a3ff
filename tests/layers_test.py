#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The tree keeps its order. The READMEs of core, proto, server and client list their layers (folders, or single
modules) under "Layers", each below those that may use it. Inside a folder, modules do not include each other in a
circle. A module is a .cc file with its header.

    layers_test.py PROJECT_FOLDER
"""

import collections
import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(sys.argv[1])
MAY_USE = {"core": [], "proto": [], "server": ["core", "proto"], "client": ["core", "proto", "server"]}
SOURCES = sorted(
    path.relative_to(ROOT)
    for folder in [*MAY_USE, "tests"]
    for path in (ROOT / folder).rglob("*")
    if path.suffix in (".cc", ".h")
)
PUBLIC = {
    f"{top}/{header}"
    for top in ("core", "client")
    for lists in (ROOT / top).rglob("CMakeLists.txt")
    for headers in re.findall(r"_PUBLIC_HEADERS\s([^)]*)\)", lists.read_text())
    for header in headers.split()
}


def includes(path):
    """The headers of the tree that a file includes."""
    names = re.findall(r'^#include "([^"]+)"', (ROOT / path).read_text(), re.M)
    return [pathlib.Path(name) for name in names if name.split("/")[0] in [*MAY_USE, "tests"]]


def layers(top):
    """Layer -> its place in the order, from the first table of the section."""
    section = (ROOT / top / "README.md").read_text().split("\n## Layers\n")[1]
    table = re.search(r"(?:^\|.*\n)+", section, re.M)[0]
    return {layer: place for place, layer in enumerate(re.findall(r"^\| `([\w/]+?)/?` \|", table, re.M))}


LAYERS = {top: layers(top) for top in MAY_USE}


def layer_of(path):
    """The innermost layer of a file, None where its README lists none."""
    inside = pathlib.Path(*path.parts[1:]).with_suffix("")
    return next((str(place) for place in [inside, *inside.parents] if str(place) in LAYERS[path.parts[0]]), None)


def uses_inside_folders():
    """Module -> the modules of the same folder that it includes."""
    uses = collections.defaultdict(set)
    for path in SOURCES:
        module = path.with_suffix("")
        uses[module] |= {used for used in (name.with_suffix("") for name in includes(path)) if used != module}
    return {module: {used for used in uses[module] if used.parent == module.parent} for module in uses}


def reachable(module, uses):
    """The modules that `module` uses, directly or through others."""
    found, to_visit = set(), [module]
    while to_visit:
        new = uses.get(to_visit.pop(), set()) - found
        found |= new
        to_visit.extend(new)
    return found


def circles():
    """The groups of modules of one folder that use each other in a circle."""
    uses = uses_inside_folders()
    reach = {module: reachable(module, uses) for module in uses}
    groups = {frozenset(other for other in reach[module] if module in reach.get(other, ())) for module in uses}
    return sorted(sorted(map(str, group)) for group in groups if group)


class LayersTest(unittest.TestCase):
    def test_every_source_is_in_a_layer(self):
        self.assertEqual([str(path) for path in SOURCES if path.parts[0] in MAY_USE and layer_of(path) is None], [])

    def test_every_layer_exists(self):
        for top, listed in LAYERS.items():
            self.assertEqual(
                [layer for layer in listed if not [*(ROOT / top).glob(layer), *(ROOT / top).glob(f"{layer}.*")]], []
            )

    def test_tests_mirror_the_layers(self):
        for path in SOURCES:
            if path.parts[0] == "tests" and path.parts[1] in MAY_USE and len(path.parts) > 3:
                with self.subTest(file=str(path)):
                    self.assertIn("/".join(path.parts[2:-1]), LAYERS[path.parts[1]])

    def test_no_header_includes_itself(self):
        self.assertEqual([str(path) for path in SOURCES if path in includes(path)], [])

    def test_no_include_runs_up(self):
        for path in SOURCES:
            top = path.parts[0]
            for name in includes(path):
                if top == "tests":
                    continue
                with self.subTest(file=str(path), includes=str(name)):
                    if name.parts[0] == top:
                        self.assertLessEqual(LAYERS[top][layer_of(name)], LAYERS[top][layer_of(path)])
                    else:
                        self.assertIn(name.parts[0], MAY_USE[top])

    def test_no_circle_of_modules_inside_a_folder(self):
        self.assertEqual(circles(), [])

    def test_others_include_only_public_headers_of_the_engine(self):
        for path in SOURCES:
            if path.parts[0] in ("server", "client") or path.parent.name == "installed_package":
                inside = [str(name) for name in includes(path) if name.parts[0] == "core"]
                with self.subTest(file=str(path)):
                    self.assertEqual([name for name in inside if name not in PUBLIC], [])

    def test_public_headers_include_only_public_headers(self):
        for header in sorted(PUBLIC):
            with self.subTest(file=header):
                self.assertEqual([str(name) for name in includes(header) if str(name) not in PUBLIC], [])

    def test_no_file_name_occurs_twice(self):
        count = collections.Counter(path.name for path in SOURCES)
        self.assertEqual([name for name, times in count.items() if times > 1 and name != "main.cc"], [])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
