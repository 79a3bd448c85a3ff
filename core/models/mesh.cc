// SPDX-License-Identifier: Apache-2.0
#include "core/models/mesh.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace dlcs {
namespace {

// The edges from the first corner, 3 × dimension.
Matrix EdgesOf(const Mesh& mesh, const Mesh::Element& element) {
  Matrix edges(3, element.dimension);
  for (int k = 0; k < element.dimension; ++k) {
    edges.col(k) = mesh.points.col(element.nodes[static_cast<std::size_t>(k) + 1]) - mesh.points.col(element.nodes[0]);
  }
  return edges;
}

double MeasureOf(const Matrix& edges) {
  if (edges.cols() == 0) return 1;
  // Table: the factorials of 0 to 3.
  constexpr double kFactorials[] = {1, 1, 2, 6};
  return std::sqrt(std::max(0.0, (edges.transpose() * edges).determinant())) / kFactorials[edges.cols()];
}

}  // namespace

int Mesh::dimension() const {
  int largest = 0;
  for (const Element& element : elements) largest = std::max(largest, element.dimension);
  return largest;
}

double Measure(const Mesh& mesh, const Mesh::Element& element) { return MeasureOf(EdgesOf(mesh, element)); }

FiniteElements Assemble(const Mesh& mesh) {
  const int d = mesh.dimension();
  const Index nodes = mesh.points.cols();
  std::vector<Eigen::Triplet<double>> stiffness, mass;
  FiniteElements assembled{.stiffness = {nodes, nodes}, .mass = {nodes, nodes}, .loads = Vector::Zero(nodes)};
  for (const Mesh::Element& element : mesh.elements) {
    if (element.dimension != d || d == 0) continue;
    const Matrix edges = EdgesOf(mesh, element);
    const double measure = MeasureOf(edges);
    // φ_{k+1} is one at the end of edge k, and zero at the other corners; φ_0 is one minus their sum.
    Matrix gradients(3, d + 1);
    gradients.rightCols(d) = edges * (edges.transpose() * edges).inverse();
    gradients.col(0) = -gradients.rightCols(d).rowwise().sum();
    for (int i = 0; i <= d; ++i) {
      const Index row = element.nodes[static_cast<std::size_t>(i)];
      assembled.loads[row] += measure / (d + 1);
      for (int j = 0; j <= d; ++j) {
        const Index column = element.nodes[static_cast<std::size_t>(j)];
        stiffness.emplace_back(row, column, measure * gradients.col(i).dot(gradients.col(j)));
        mass.emplace_back(row, column, measure * (i == j ? 2 : 1) / ((d + 1) * (d + 2)));
      }
    }
  }
  assembled.stiffness.setFromTriplets(stiffness.begin(), stiffness.end());
  assembled.mass.setFromTriplets(mass.begin(), mass.end());
  return assembled;
}

}  // namespace dlcs
