// SPDX-License-Identifier: Apache-2.0
#include "core/models/heat.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "core/linalg/norms.h"
#include "core/models/mesh.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;

// The unit cube of the given dimension in Q^d boxes, each cut into d! simplices; its face x_1 = 0 is the group 7,
// "wall", its face x_1 = 1 the group 8 without a name.
Mesh Cube(int dimension, Index cells) {
  Mesh mesh;
  const Index side = cells + 1, nodes = static_cast<Index>(std::pow(side, dimension));
  mesh.points = Matrix::Zero(3, nodes);
  for (Index k = 0; k < nodes; ++k) {
    mesh.numbers.push_back(10 + k);
    Index rest = k;
    for (int d = 0; d < dimension; ++d, rest /= side) mesh.points(d, k) = static_cast<double>(rest % side) / cells;
  }
  std::array<Index, 3> stride = {1, side, side * side};
  const auto add = [&](Index corner, std::vector<int> axes, std::vector<int> groups) {
    do {  // Kuhn's simplices: a path along the axes in every order
      Mesh::Element element{.dimension = static_cast<int>(axes.size()), .groups = groups};
      Index at = corner;
      element.nodes[0] = at;
      for (std::size_t k = 0; k < axes.size(); ++k) {
        at += stride[static_cast<std::size_t>(axes[k])];
        element.nodes[k + 1] = at;
      }
      element.number = static_cast<std::int64_t>(mesh.elements.size()) + 1;
      mesh.elements.push_back(element);
    } while (std::next_permutation(axes.begin(), axes.end()));
  };
  std::vector<int> axes, across;
  for (int d = 0; d < dimension; ++d) axes.push_back(d);
  across.assign(axes.begin() + 1, axes.end());
  for (Index k = 0; k < nodes; ++k) {
    bool inside = true, inside_across = true;
    for (const int d : axes) {
      const bool last = mesh.points(d, k) > 1 - 0.5 / cells;
      inside = inside && !last;
      inside_across = inside_across && (d == 0 || !last);
    }
    if (inside) add(k, axes, {});
    if (inside_across && mesh.points(0, k) == 0) add(k, across, {7});
    if (inside_across && mesh.points(0, k) == 1) add(k, across, {8});
  }
  mesh.groups = {{dimension - 1, 7, "wall"}};
  return mesh;
}

TEST(HeatTest, MatricesOfOneTriangleAreThoseOfTheBooks) {
  Mesh mesh;
  mesh.points = Matrix{{0, 3, 0}, {0, 0, 4}, {0, 0, 0}};
  mesh.numbers = {1, 2, 3};
  mesh.elements = {{.dimension = 2, .nodes = {0, 1, 2}}};
  const FiniteElements elements = Assemble(mesh);
  // Gradients (-1/3, -1/4), (1/3, 0), (0, 1/4); area 6.
  const Matrix stiffness{{25.0 / 24, -2.0 / 3, -3.0 / 8}, {-2.0 / 3, 2.0 / 3, 0}, {-3.0 / 8, 0, 3.0 / 8}};
  EXPECT_LE(MaxAbs(Matrix(elements.stiffness) - stiffness), 1e-15);
  const Matrix mass{{1, 0.5, 0.5}, {0.5, 1, 0.5}, {0.5, 0.5, 1}};
  EXPECT_LE(MaxAbs(Matrix(elements.mass) - mass), 1e-15);
  EXPECT_LE(MaxAbs(elements.loads - Vector::Constant(3, 2)), 1e-15);
}

TEST(HeatTest, ElementsIntegrateLinearFunctionsExactly) {
  for (const int dimension : {1, 2, 3}) {
    const Mesh mesh = Cube(dimension, 3);
    const FiniteElements elements = Assemble(mesh);
    const Vector ones = Vector::Ones(mesh.points.cols()), x = mesh.points.row(0).transpose();
    EXPECT_NEAR(elements.loads.sum(), 1, 1e-14);
    EXPECT_NEAR(ones.dot(elements.mass * ones), 1, 1e-14);
    EXPECT_NEAR(x.dot(elements.mass * x), 1.0 / 3, 1e-14);
    EXPECT_NEAR(x.dot(elements.stiffness * x), 1, 1e-13);
    EXPECT_LE(MaxAbs(elements.stiffness * ones), 1e-13);
  }
}

// How far u at T = 12 is from the parabola x²/2 - x, where a heat loss of one everywhere is made up by the wall x = 0.
double ErrorAtRest(int dimension, Index cells) {
  const HeatModel model{.mesh = Cube(dimension, cells), .contact = {"wall"}, .horizon = 12, .load = "-1"};
  const auto made = MakeHeatProblem(model);
  EXPECT_TRUE(made.ok()) << made.status();
  Options options;
  options.output_times = {model.horizon};
  options.output_times_only = true;
  options.num_steps = 400;
  const Solution solution = testing::SolveToEnd(made->problem, options);
  EXPECT_NEAR((made->problem.B * solution.y.col(0)).sum(), 1, 1e-6);  // what all of the body loses
  EXPECT_GE(solution.y.minCoeff(), 0);
  double error = 0;
  for (std::size_t k = 0; k < made->nodes.size(); ++k) {
    const double x = model.mesh.points(0, made->nodes[k] - 10);
    error = std::max(error, std::abs(solution.x(static_cast<Index>(k), 0) - (x * x / 2 - x)));
  }
  return error;
}

TEST(HeatTest, TheWallGivesWhatTheBodyLoses) {
  EXPECT_LE(ErrorAtRest(1, 16), 1e-6);  // the parabola at nodes is exact
  EXPECT_LE(ErrorAtRest(2, 16), ErrorAtRest(2, 8) / 3);
  EXPECT_LE(ErrorAtRest(3, 6), ErrorAtRest(3, 3) / 2.5);
}

// A body that is warm all the time does not touch the wall: the wall gives nothing, and all heat stays.
TEST(HeatTest, AWarmBodyKeepsItsHeat) {
  const HeatModel model{.mesh = Cube(2, 6), .contact = {"7"}, .coefficient = 0.3, .horizon = 2, .load = "2*t"};
  const auto made = MakeHeatProblem(model);
  ASSERT_TRUE(made.ok()) << made.status();
  const Solution solution = testing::SolveForEnd(made->problem);
  EXPECT_LE(MaxAbs(solution.y), 1e-12);
  EXPECT_LE(MaxAbs(solution.x - Matrix::Constant(solution.x.rows(), 1, 4)), 1e-6);
}

TEST(HeatTest, FixedNodesAreNoStates) {
  const Mesh mesh = Cube(2, 4);
  const auto made = MakeHeatProblem({.mesh = mesh, .contact = {"wall"}, .fixed = {"8"}});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->problem.num_states(), 20);
  EXPECT_EQ(made->problem.num_constraints(), 5);
  for (const std::int64_t node : made->nodes) EXPECT_LT(mesh.points(0, node - 10), 1);
}

TEST(HeatTest, NamesWhatIsWrong) {
  const auto error_of = [](const HeatModel& model) { return std::string(MakeHeatProblem(model).status().message()); };
  EXPECT_THAT(error_of({.mesh = Cube(2, 2)}), HasSubstr("contact: missing"));
  EXPECT_THAT(error_of({.mesh = Cube(2, 2), .contact = {"wal"}}),
              HasSubstr("contact: \"wal\"; the mesh has no physical group of lines with this name or number: it has "
                        "\"wall\", 8"));
  EXPECT_THAT(error_of({.mesh = Cube(3, 2), .contact = {"wall"}, .fixed = {"9"}}), HasSubstr("group of triangles"));
  EXPECT_THAT(error_of({.mesh = Cube(2, 2), .contact = {"wall"}, .fixed = {"wall"}}),
              HasSubstr("at least one must be"));
  EXPECT_THAT(error_of({.mesh = Mesh(), .contact = {"wall"}}), HasSubstr("mesh: no lines, triangles or tetrahedra"));
  EXPECT_THAT(error_of({.mesh = Cube(2, 2), .contact = {"wall"}, .coefficient = -1}), HasSubstr("coefficient"));
  EXPECT_THAT(error_of({.mesh = Cube(2, 2), .contact = {"wall"}, .load = "sin("}), HasSubstr("f."));
  Mesh flat = Cube(2, 2);
  flat.points.row(1).setZero();
  EXPECT_THAT(error_of({.mesh = flat, .contact = {"wall"}}), HasSubstr("is flat: area 0"));
}

}  // namespace
}  // namespace dlcs
