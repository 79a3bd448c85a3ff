// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/sparse/sparse_factor.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseLU>
#include <algorithm>
#include <limits>
#include <optional>

#include "core/linalg/equilibration.h"
#include "core/linalg/norms.h"
#include "core/linalg/sparse/factor_panels.h"
#include "core/linalg/structured_matrix.h"
#include "core/linalg/weyl_sequence.h"

namespace dlcs {
namespace {

// Pivots on the diagonal keep the order that was chosen for their sake. Growth is bounded by its inverse a column, and
// does not come near that for matrices whose diagonal is not small.
constexpr double kPivotThreshold = 0.01;
// The residual of a solve, beside its terms, up to which the factors have not grown.
constexpr double kMostResidual = 1e-12;

template <typename Scalar>
Eigen::SparseMatrix<Scalar> Shifted(const SparseMatrix& A, Scalar z, double s, const SparseMatrix& E) {
  if (E.rows() > 0) return z * E.template cast<Scalar>() - (s * A).template cast<Scalar>();
  Eigen::SparseMatrix<Scalar> identity(A.rows(), A.rows());
  identity.setIdentity();
  return z * identity - (s * A).template cast<Scalar>();
}

// Ones where a matrix has an entry, so that nothing cancels.
template <typename Scalar>
SparseMatrix Ones(const Eigen::SparseMatrix<Scalar>& matrix) {
  SparseMatrix ones = matrix.real();
  std::fill_n(ones.valuePtr(), ones.nonZeros(), 1.0);
  return ones;
}

// Ones where A or E has an entry.
SparseMatrix Pattern(const SparseMatrix& A, const SparseMatrix& E) {
  return E.rows() > 0 ? SparseMatrix(Ones(A) + Ones(E)) : Ones(A);
}

// Twos and ones where the matrix or its transpose has an entry.
template <typename Scalar>
SparseMatrix SymmetricPattern(const Eigen::SparseMatrix<Scalar>& matrix) {
  const SparseMatrix ones = Ones(matrix);
  return ones + SparseMatrix(ones.transpose());
}

// The size of a factor of a matrix with this symmetric pattern, in its own order.
FactorSize SizeOfFactor(const SparseMatrix& pattern) {
  FactorSize size{.matrix_nonzeros = static_cast<double>(pattern.nonZeros())};
  for (const Index entries : PredictColumns(pattern, pattern).entries) {
    const auto below = static_cast<double>(entries - 1);
    size.nonzeros += below + 1;
    size.multiplications += below * (below + 3) / 2;
  }
  return size;
}

}  // namespace

FactorSize PredictFactor(const SparseMatrix& A, const SparseMatrix& E) {
  SparseMatrix ordered;
  ordered = SymmetricPattern(Pattern(A, E)).twistedBy(SparseOrder(A, E));
  return SizeOfFactor(ordered);
}

Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> SparseOrder(const SparseMatrix& A,
                                                                          const SparseMatrix& E) {
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> inverse;
  Eigen::AMDOrdering<int>()(Pattern(A, E), inverse);
  return inverse.inverse();
}

namespace {

template <typename Scalar, typename Body>
void ForEntries(const Eigen::SparseMatrix<Scalar>& matrix, const Body& body) {
  for (Index j = 0; j < matrix.cols(); ++j) {
    for (typename Eigen::SparseMatrix<Scalar>::InnerIterator entry(matrix, j); entry; ++entry) {
      body(entry.row(), j, entry.value());
    }
  }
}

// Powers of two for rows and columns, such that the largest entry of each is of size one.
template <typename Scalar>
Equilibration UnitsOf(const Eigen::SparseMatrix<Scalar>& matrix) {
  Equilibration units{Vector::Zero(matrix.rows()), Vector::Zero(matrix.cols())};
  ForEntries(matrix,
             [&](Index, Index j, Scalar value) { units.column[j] = std::max(units.column[j], std::abs(value)); });
  units.column = units.column.unaryExpr([](double size) { return 1 / PowerOfTwo(size); });
  ForEntries(matrix, [&](Index i, Index j, Scalar value) {
    units.row[i] = std::max(units.row[i], std::abs(value) * units.column[j]);
  });
  units.row = units.row.unaryExpr([](double size) { return 1 / PowerOfTwo(size); });
  return units;
}

// LU in the order of the matrix. Its arrays are made for the entries that the pattern predicts; Eigen makes them for
// twenty times those of the matrix, which on grids in the plane is three times too many.
template <typename Scalar>
class OrderedLu : public Eigen::SparseLU<Eigen::SparseMatrix<Scalar>, Eigen::NaturalOrdering<int>> {
 public:
  void Factor(const Eigen::SparseMatrix<Scalar>& ordered, double pivot_threshold) {
    constexpr double kRoom = 1.3;  // for pivots off the diagonal; beyond that the arrays grow
    this->setPivotThreshold(pivot_threshold);
    const double predicted = SizeOfFactor(SymmetricPattern(ordered)).nonzeros;
    const double times = kRoom * predicted / static_cast<double>(ordered.nonZeros());
    this->m_perfv.fillfactor = 1 + static_cast<Eigen::Index>(times);
    this->compute(ordered);
  }

  double bytes() const {
    const auto& arrays = this->m_glu;
    return static_cast<double>(sizeof(Scalar)) * static_cast<double>(arrays.lusup.size() + arrays.ucol.size()) +
           static_cast<double>(sizeof(int)) * static_cast<double>(arrays.lsub.size() + arrays.usub.size());
  }
};

}  // namespace

template <typename Scalar>
struct SparseFactor<Scalar>::Factors {
  using Ordered = Eigen::SparseMatrix<Scalar>;

  void FactorByColumns(const Ordered& ordered, const Equilibration& in, double pivot_threshold) {
    panels.reset();
    units = in;
    lu.Factor(units.row.asDiagonal() * ordered * units.column.asDiagonal(), pivot_threshold);
  }
  template <typename Columns>
  Columns SolveByColumns(const Columns& right) const {
    const Columns scaled = lu.solve(Columns(units.row.asDiagonal() * right));
    return units.column.asDiagonal() * scaled;
  }

  std::optional<FactorPanels> panels;
  // Where there are none: in units, since pivots are compared with other rows.
  OrderedLu<Scalar> lu;
  Equilibration units;
};

template <typename Scalar>
SparseFactor<Scalar>::SparseFactor(const SparseMatrix& A, const Order& order, Scalar z, double s, const SparseMatrix& E)
    : order_(order), factors_(std::make_unique<Factors>()) {
  typename Factors::Ordered ordered;
  ordered = Shifted(A, z, s, E).twistedBy(order);
  ordered.makeCompressed();
  if constexpr (std::is_same_v<Scalar, double>) {
    if (IsSymmetric(A) && IsSymmetric(E)) factors_->panels = FactorPanels::Cholesky(ordered);
    if (!factors_->panels) factors_->panels = FactorPanels::Lu(ordered, kPivotThreshold);
  }
  const Equilibration units = UnitsOf(ordered);
  if (!factors_->panels) factors_->FactorByColumns(ordered, units, kPivotThreshold);
  if (!Probe(ordered, units)) {
    factors_->FactorByColumns(ordered, units, 1);
    Probe(ordered, units);
  }
}

template <typename Scalar>
bool SparseFactor<Scalar>::Probe(const Eigen::SparseMatrix<Scalar>& ordered, const Equilibration& units) {
  is_regular_ = factors_->panels || factors_->lu.info() == Eigen::Success;
  if (!is_regular_) return false;
  const Index m = ordered.rows();
  Column right(m);
  for (Index i = 0; i < m; ++i) {
    right[i] = (i % 2 ? -1.0 : 1.0) * (1 + WeylValue(static_cast<double>(i))) / units.row[i];
  }
  Column x = right;
  SolveInOrder(x);
  Column residual = right;
  Vector terms = right.cwiseAbs(), sums = Vector::Zero(m);
  ForEntries(ordered, [&](Index i, Index j, Scalar value) {
    residual[i] -= value * x[j];
    terms[i] += std::abs(value * x[j]);
    sums[j] += std::abs(value) * units.row[i] * units.column[j];
  });
  // ‖A‖_1 ‖A⁻¹v‖ / ‖v‖ is below the condition number, and seldom far for a v without a pattern.
  const double condition = MaxAbs(sums) * MaxAbs(x.cwiseAbs().cwiseQuotient(units.column)) / 2;
  is_regular_ = condition * std::numeric_limits<double>::epsilon() < 1;  // not for NaN
  return (residual.cwiseAbs().array() <= kMostResidual * terms.array()).all();
}

template <typename Scalar>
SparseFactor<Scalar>::SparseFactor(SparseFactor&&) noexcept = default;
template <typename Scalar>
SparseFactor<Scalar>::~SparseFactor() = default;

template <typename Scalar>
double SparseFactor<Scalar>::bytes() const {
  return factors_->panels ? factors_->panels->bytes() : factors_->lu.bytes();
}

template <typename Scalar>
double SparseFactor<Scalar>::bytes_of_a_solve() const {
  return factors_->panels ? factors_->panels->bytes_of_a_solve() : bytes();
}

template <typename Scalar>
bool SparseFactor<Scalar>::has_halves() const {
  return is_regular_ && factors_->panels.has_value();
}

template <typename Scalar>
typename SparseFactor<Scalar>::Column SparseFactor<Scalar>::FirstHalf(const Eigen::Ref<const Column>& right) const {
  Column half = order_ * right;
  if constexpr (std::is_same_v<Scalar, double>) factors_->panels->SolveForward(half);
  return half;
}

template <typename Scalar>
typename SparseFactor<Scalar>::Column SparseFactor<Scalar>::FirstHalfOfTranspose(
    const Eigen::Ref<const Column>& right) const {
  Column half = order_ * right;
  if constexpr (std::is_same_v<Scalar, double>) factors_->panels->SolveTransposedForward(half);
  return half;
}

template <typename Scalar>
typename SparseFactor<Scalar>::Column SparseFactor<Scalar>::SecondHalf(Column half) const {
  if constexpr (std::is_same_v<Scalar, double>) factors_->panels->SolveBackward(half);
  return order_.inverse() * half;
}

template <typename Scalar>
void SparseFactor<Scalar>::SolveInOrder(Column& column) const {
  if constexpr (std::is_same_v<Scalar, double>) {
    if (factors_->panels) {
      factors_->panels->SolveForward(column);
      return factors_->panels->SolveBackward(column);
    }
  }
  column = factors_->SolveByColumns(column);
}

template <typename Scalar>
typename SparseFactor<Scalar>::Columns SparseFactor<Scalar>::Solve(const Eigen::Ref<const Columns>& columns) const {
  if (!is_regular_) {
    return Columns::Constant(columns.rows(), columns.cols(), Scalar(std::numeric_limits<double>::quiet_NaN()));
  }
  if (!factors_->panels && columns.cols() > 1) {
    return order_.inverse() * factors_->SolveByColumns(Columns(order_ * columns));
  }
  Columns result(columns.rows(), columns.cols());
  Column ordered(columns.rows());
  for (Index j = 0; j < columns.cols(); ++j) {
    ordered.noalias() = order_ * columns.col(j);
    SolveInOrder(ordered);
    result.col(j).noalias() = order_.inverse() * ordered;
  }
  return result;
}

template class SparseFactor<double>;
template class SparseFactor<std::complex<double>>;

}  // namespace dlcs
