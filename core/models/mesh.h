// SPDX-License-Identifier: Apache-2.0
// A mesh of lines, triangles or tetrahedra.

#ifndef DLCS_CORE_MODELS_MESH_H_
#define DLCS_CORE_MODELS_MESH_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/linalg/structured_matrix.h"
#include "core/types.h"

namespace dlcs {

struct Mesh {
  // A point, line, triangle or tetrahedron: the first dimension + 1 of `nodes` are its corners.
  struct Element {
    int dimension = 0;
    std::array<Index, 4> nodes = {};
    std::vector<int> groups = {};  // physical groups of its dimension
    std::int64_t number = 0;       // in the file
  };
  struct Group {
    int dimension = 0;
    int tag = 0;
    std::string name = {};  // may be empty
  };

  Matrix points;                      // 3 × nodes
  std::vector<std::int64_t> numbers;  // of the nodes, in the file
  std::vector<Element> elements;
  std::vector<Group> groups;  // those with a name

  // The largest dimension of an element, that of the body; 0 without elements.
  int dimension() const;
};

// The matrices of linear elements on the elements of dimension mesh.dimension(), nodes × nodes:
//     K_ij = ∫ ∇φ_i · ∇φ_j,    E_ij = ∫ φ_i φ_j,    loads_i = ∫ φ_i.
// Rows of nodes that no such element touches are zero. Lines and triangles may lie in space: gradients are those along
// them.
struct FiniteElements {
  SparseMatrix stiffness;  // K
  SparseMatrix mass;       // E
  Vector loads;
};
FiniteElements Assemble(const Mesh& mesh);

// The length, area or volume of an element; 1 for a point.
double Measure(const Mesh& mesh, const Mesh::Element& element);

}  // namespace dlcs

#endif  // DLCS_CORE_MODELS_MESH_H_
