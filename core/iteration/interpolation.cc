// SPDX-License-Identifier: Apache-2.0
#include "core/iteration/interpolation.h"

#include <Eigen/SparseLU>

namespace dlcs {
namespace {

// Second derivatives, one row a node, of the cubic spline through the rows of `values`, with steps of lengths `h`.
Matrix SecondDerivatives(const std::vector<double>& h, const Matrix& values) {
  const auto steps = static_cast<Index>(h.size());
  if (steps == 1) return Matrix::Zero(2, values.cols());
  std::vector<Eigen::Triplet<double>> entries;
  Matrix right = Matrix::Zero(steps + 1, values.cols());
  for (Index i = 1; i < steps; ++i) {
    entries.insert(entries.end(), {{static_cast<int>(i), static_cast<int>(i - 1), h[i - 1]},
                                   {static_cast<int>(i), static_cast<int>(i), 2 * (h[i - 1] + h[i])},
                                   {static_cast<int>(i), static_cast<int>(i + 1), h[i]}});
    right.row(i) = 6 * ((values.row(i + 1) - values.row(i)) / h[i] - (values.row(i) - values.row(i - 1)) / h[i - 1]);
  }
  // The third derivative does not jump at the second node and the last but one; a parabola has none.
  const auto no_jump = [&](Index row, Index left, double before, double after) {
    const int i = static_cast<int>(row), j = static_cast<int>(left);
    entries.insert(entries.end(), {{i, j, after}, {i, j + 1, -(before + after)}, {i, j + 2, before}});
  };
  if (steps == 2) {
    entries.insert(entries.end(), {{0, 0, 1}, {0, 1, -1}, {2, 1, -1}, {2, 2, 1}});
  } else {
    no_jump(0, 0, h[0], h[1]);
    no_jump(steps, steps - 2, h[steps - 2], h[steps - 1]);
  }
  Eigen::SparseMatrix<double> system(steps + 1, steps + 1);
  system.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseLU<Eigen::SparseMatrix<double>> factor(system);
  return factor.solve(right);
}

InterpolatedRun Linear(const Eigen::Ref<const Matrix>& values) {
  const Index steps = values.cols() - 1;
  return {{values.leftCols(steps), values.rightCols(steps) - values.leftCols(steps)}};
}

// A run of step `h` with the second derivatives `second` at its nodes.
InterpolatedRun Cubic(double h, const Eigen::Ref<const Matrix>& values, const Eigen::Ref<const Matrix>& second) {
  const Index steps = values.cols() - 1;
  const auto before = second.leftCols(steps), after = second.rightCols(steps);
  InterpolatedRun cubic = Linear(values);
  cubic.coefficients[1] -= h * h / 6 * (2 * before + after);
  cubic.coefficients.push_back(h * h / 2 * before);
  cubic.coefficients.push_back(h * h / 6 * (after - before));
  return cubic;
}

}  // namespace

std::vector<InterpolatedRun> Interpolate(Interpolation kind, const Grid& grid, const Matrix& values) {
  const NodeColumns columns(grid);
  std::vector<InterpolatedRun> pieces;
  for (size_t begin = 0; begin < grid.runs.size();) {
    size_t end = begin + 1;
    while (end < grid.runs.size() && !grid.runs[end].starts_at_break) ++end;
    if (kind == Interpolation::kLinear) {
      for (size_t r = begin; r < end; ++r) {
        pieces.push_back(Linear(values.middleCols(columns.First(r), columns.Count(r))));
      }
    } else {
      // The nodes of the smooth interval, those where its runs meet once.
      std::vector<double> h;
      for (size_t r = begin; r < end; ++r) h.insert(h.end(), grid.runs[r].steps, grid.runs[r].step);
      Matrix nodes(h.size() + 1, values.rows());
      Index node = 0;
      for (size_t r = begin; r < end; ++r) {
        nodes.middleRows(node, columns.Count(r)) = values.middleCols(columns.First(r), columns.Count(r)).transpose();
        node += grid.runs[r].steps;
      }
      const Matrix second = SecondDerivatives(h, nodes).transpose();
      node = 0;
      for (size_t r = begin; r < end; ++r) {
        pieces.push_back(Cubic(grid.runs[r].step, values.middleCols(columns.First(r), columns.Count(r)),
                               second.middleCols(node, columns.Count(r))));
        node += grid.runs[r].steps;
      }
    }
    begin = end;
  }
  return pieces;
}

}  // namespace dlcs
