// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/kronecker_modes.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace dlcs {
namespace {

// This is far below the rounding errors of a solve, so the short sum is as accurate as the long one.
constexpr double kResponseTolerance = 1e-13;

// X(a, (s, f)) = x[(s · length + a) · faster + f]
Matrix Unfold(const Eigen::Ref<const Vector>& x, const Axis& axis) {
  const Index slower = x.size() / (axis.length * axis.faster);
  Matrix unfolded(axis.length, slower * axis.faster);
  for (Index s = 0; s < slower; ++s) {
    const Eigen::Map<const Matrix> block(x.data() + s * axis.length * axis.faster, axis.faster, axis.length);
    unfolded.middleCols(s * axis.faster, axis.faster) = block.transpose();
  }
  return unfolded;
}

void Fold(const Matrix& unfolded, const Axis& axis, Eigen::Ref<Vector> x) {
  const Index slower = unfolded.cols() / axis.faster;
  for (Index s = 0; s < slower; ++s) {
    Eigen::Map<Matrix> block(x.data() + s * axis.length * axis.faster, axis.faster, axis.length);
    block = unfolded.middleCols(s * axis.faster, axis.faster).transpose();
  }
}

enum class Direction { kForward, kBackward };

// Applies the transforms of all factors to each column of `columns`.
void Transform(const std::vector<FactorTransform>& factors, Eigen::Ref<Matrix> columns, Direction direction) {
  const auto apply = [&](const FactorTransform& factor, Eigen::Ref<Matrix> values) {
    return direction == Direction::kForward ? factor.ForwardColumns(values) : factor.BackwardColumns(values);
  };
  if (factors.size() == 1) return apply(factors[0], columns);
  for (std::size_t k = 0; k < factors.size(); ++k) {
    Axis axis{factors[k].size(), 1};
    for (std::size_t i = k + 1; i < factors.size(); ++i) axis.faster *= factors[i].size();
    for (Index c = 0; c < columns.cols(); ++c) {
      Matrix unfolded = Unfold(columns.col(c), axis);
      apply(factors[k], unfolded);
      Fold(unfolded, axis, columns.col(c));
    }
  }
}

// The same for each row of `rows`.
void TransformRows(const std::vector<FactorTransform>& factors, Matrix& rows, Direction direction) {
  if (factors.size() == 1) {
    return direction == Direction::kForward ? factors[0].ForwardRows(rows) : factors[0].BackwardRows(rows);
  }
  rows.transposeInPlace();
  Transform(factors, rows, direction);
  rows.transposeInPlace();
}

// The eigenvalues of the Kronecker sum of the factors, in the order of the grid.
Vector SumsOfEigenvalues(const std::vector<FactorTransform>& factors) {
  Vector sums = Vector::Zero(1);
  for (const FactorTransform& factor : factors) {
    Matrix next(factor.size(), sums.size());  // the factor runs faster than what is there
    for (Index s = 0; s < sums.size(); ++s) next.col(s) = (factor.eigenvalues().array() + sums[s]).matrix();
    sums = Eigen::Map<const Vector>(next.data(), next.size());
  }
  return sums;
}

struct Walls {
  std::size_t axis_factor;
  Axis axis;
  OuterProduct B, N;  // N transposed
};

// The axis along which B and N act through one vector each.
std::optional<Walls> FindWalls(const Problem& problem, const KroneckerSum& sum) {
  const SparseMatrix B = problem.B.Sparse();
  const SparseMatrix N = SparseMatrix(problem.N.Sparse().transpose());
  // The fastest axis first: its lines are contiguous.
  for (std::size_t k = sum.factors.size(); k-- > 0;) {
    Axis axis{sum.factors[k].rows(), 1};
    for (std::size_t i = k + 1; i < sum.factors.size(); ++i) axis.faster *= sum.factors[i].rows();
    auto of_B = AsOuterProduct(B, axis);
    auto of_N = AsOuterProduct(N, axis);
    if (of_B && of_N) return Walls{k, axis, *std::move(of_B), *std::move(of_N)};
  }
  return std::nullopt;
}

bool HasOneSign(const SparseMatrix& matrix) {
  const Eigen::Map<const Vector> values(matrix.valuePtr(), matrix.nonZeros());
  return values.size() == 0 || values.minCoeff() >= 0 || values.maxCoeff() <= 0;
}

bool IsMetzler(const SparseMatrix& factor) {
  for (Index j = 0; j < factor.outerSize(); ++j) {
    for (SparseMatrix::InnerIterator entry(factor, j); entry; ++entry) {
      if (entry.row() != j && entry.value() < 0) return false;
    }
  }
  return true;
}

}  // namespace

void KroneckerModes::Drive(const SeparableMatrix& E, const Eigen::Ref<const Matrix>& u, Eigen::Ref<Matrix> inputs,
                           Workers& workers) const {
  workers.ForBlocks(u.cols(), kColumnsPerBlock, [&](Index, Index begin, Index end) {
    auto block = inputs.middleCols(begin, end - begin);
    E.Multiply(u.middleCols(begin, end - begin), block);
    Transform(across, block, Direction::kForward);
  });
}

void KroneckerModes::AddObserved(const Eigen::Ref<const Matrix>& base, Eigen::Ref<Matrix> z, Workers& workers,
                                 Eigen::Ref<Matrix> sum, const OnColumns& computed) const {
  workers.ForBlocks(z.cols(), kColumnsPerBlock, [&](Index, Index begin, Index end) {
    auto block = z.middleCols(begin, end - begin);
    Transform(across, block, Direction::kBackward);
    D.AddProduct(base.middleCols(begin, end - begin), block, sum.middleCols(begin, end - begin));
    computed(begin, end);
  });
}

Matrix KroneckerModes::Observe(Matrix z, Workers& workers) const {
  if (!D.is_diagonal()) {
    Matrix N_x = Matrix::Zero(D.sparse().rows(), z.cols());
    AddObserved(N_x, z, workers, N_x, [](Index, Index) {});
    return N_x;
  }
  workers.ForBlocks(z.cols(), kColumnsPerBlock, [&](Index, Index begin, Index end) {
    auto block = z.middleCols(begin, end - begin);
    Transform(across, block, Direction::kBackward);
    D.Multiply(block, block);
  });
  return z;
}

Matrix KroneckerModes::Couple(const Vector& values) const {
  // The whole function of R where C does not leave out most of it.
  const bool whole = across.size() == 1 && across[0].is_fast() && C.sparse().cols() >= num_modes();
  if (whole) return D.sparse() * Matrix(across[0].Function(values) * C.sparse());
  return D.sparse() * FromModes(values.asDiagonal() * ToModes(Matrix(C.sparse())));
}

Matrix KroneckerModes::ToModes(Matrix u) const {
  Transform(across, u, Direction::kForward);
  return u;
}

Matrix KroneckerModes::FromModes(Matrix z) const {
  Transform(across, z, Direction::kBackward);
  return z;
}

void KroneckerModes::ToModesInPlace(Eigen::Ref<Vector> u, FactorTransform::Workspace& workspace) const {
  if (across.size() == 1) return across[0].ForwardInPlace(u, workspace);
  u = ToModes(u);
}

void KroneckerModes::FromModesInPlace(Eigen::Ref<Vector> z, FactorTransform::Workspace& workspace) const {
  if (across.size() == 1) return across[0].BackwardInPlace(z, workspace);
  z = FromModes(z);
}

Matrix KroneckerModes::StateToModes(const Eigen::Ref<const Vector>& x) const {
  Matrix modes = Unfold(x, axis);
  along.ForwardColumns(modes);
  TransformRows(across, modes, Direction::kForward);
  return modes;
}

void KroneckerModes::StateFromModes(Matrix modes, Eigen::Ref<Vector> x) const {
  TransformRows(across, modes, Direction::kBackward);
  along.BackwardColumns(modes);
  Fold(modes, axis, x);
}

std::shared_ptr<const KroneckerModes> FindKroneckerModes(const Problem& problem, std::string& why_not) {
  const KroneckerSum* sum = problem.A.kronecker_sum();
  if (problem.has_mass()) {
    why_not = "there is a mass matrix";
    return nullptr;
  }
  if (!sum) {
    why_not = "A is " + problem.A.Describe() + ", not a Kronecker sum";
    return nullptr;
  }
  const auto walls = FindWalls(problem, *sum);
  if (!walls) {
    why_not = "B and N do not act along one axis of the grid through one vector each";
    return nullptr;
  }
  std::optional<FactorTransform> along;
  std::vector<FactorTransform> across;
  for (std::size_t k = 0; k < sum->factors.size(); ++k) {
    auto transform = FactorTransform::Create(sum->factors[k]);
    if (!transform) {
      why_not = "factor " + std::to_string(k) + " of A is not symmetric";
      return nullptr;
    }
    if (k == walls->axis_factor) {
      along = *std::move(transform);
    } else {
      across.push_back(*std::move(transform));
    }
  }
  auto modes = std::make_shared<KroneckerModes>();
  modes->num_states = problem.num_states();
  modes->axis = walls->axis;
  modes->along = *along;
  modes->across = std::move(across);
  modes->mu = along->eigenvalues();
  modes->lambda = SumsOfEigenvalues(modes->across);
  modes->b = along->Forward(walls->B.along);
  modes->n = along->Forward(walls->N.along);
  modes->C = SeparableMatrix(walls->B.across);
  modes->D = SeparableMatrix(walls->N.across.transpose());
  modes->basis = ChooseBasis(modes->mu);
  const std::vector<SparseMatrix>& factors = problem.A.kronecker_sum()->factors;
  modes->keeps_sign = HasOneSign(problem.B.Sparse()) && HasOneSign(problem.N.Sparse()) &&
                      std::all_of(factors.begin(), factors.end(), IsMetzler);
  modes->response = Compress({.rates = modes->mu, .weights = modes->n.cwiseProduct(modes->b)}, kResponseTolerance);
  return modes;
}

}  // namespace dlcs
