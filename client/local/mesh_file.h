// SPDX-License-Identifier: Apache-2.0
// Reads meshes of Gmsh.

#ifndef DLCS_CLIENT_LOCAL_MESH_FILE_H_
#define DLCS_CLIENT_LOCAL_MESH_FILE_H_

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "core/models/mesh.h"

namespace dlcs::client {

// The points, lines, triangles and tetrahedra of a file in the format MSH 2.2 or 4.1, ASCII, with their physical
// groups. Sections that hold no mesh, such as $NodeData, are skipped. Refused are binary files, other versions, and
// elements of other shapes or of higher order. `source` names the file in errors.
// Errors: InvalidArgument with "source:line: rule".
// Source: Gmsh reference manual, "MSH file format" (https://gmsh.info/doc/texinfo/gmsh.html).
absl::StatusOr<Mesh> ParseMesh(std::string_view text, const std::string& source);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_LOCAL_MESH_FILE_H_
