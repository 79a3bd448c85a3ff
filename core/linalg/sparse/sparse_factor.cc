// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/sparse/sparse_factor.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseLU>
#include <algorithm>
#include <limits>
#include <optional>

#include "core/linalg/norms.h"
#include "core/linalg/sparse/factor_panels.h"
#include "core/linalg/structured_matrix.h"
#include "core/linalg/weyl_sequence.h"

namespace dlcs {
namespace {

// Pivots on the diagonal keep the order that was chosen for their sake. Growth is bounded by its inverse a column, and
// does not come near that for matrices whose diagonal is not small.
constexpr double kPivotThreshold = 0.01;

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

// LU in the order of the matrix. Its arrays are made for the entries that the pattern predicts; Eigen makes them for
// twenty times those of the matrix, which on grids in the plane is three times too many.
template <typename Scalar>
class OrderedLu : public Eigen::SparseLU<Eigen::SparseMatrix<Scalar>, Eigen::NaturalOrdering<int>> {
 public:
  void Factor(const Eigen::SparseMatrix<Scalar>& ordered) {
    constexpr double kRoom = 1.3;  // for pivots off the diagonal; beyond that the arrays grow
    this->setPivotThreshold(kPivotThreshold);
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
  std::optional<FactorPanels> panels;
  OrderedLu<Scalar> lu;  // where there are none
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
  if (!factors_->panels) factors_->lu.Factor(ordered);
  is_regular_ = factors_->panels || factors_->lu.info() == Eigen::Success;
  if (!is_regular_) return;
  // ‖A‖_1 ‖A⁻¹v‖ / ‖v‖ is below the condition number, and seldom far for a v without a pattern.
  Column probe(A.rows());
  for (Index i = 0; i < A.rows(); ++i) probe[i] = (i % 2 ? -1.0 : 1.0) * (1 + WeylValue(static_cast<double>(i)));
  double norm = 0;
  for (Index j = 0; j < ordered.cols(); ++j) norm = NanMax(norm, ordered.col(j).cwiseAbs().sum());
  SolveInOrder(probe);
  const double condition = norm * MaxAbs(probe.cwiseAbs()) / 2;
  is_regular_ = condition * std::numeric_limits<double>::epsilon() < 1;  // not for NaN
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
  column = factors_->lu.solve(column).eval();
}

template <typename Scalar>
typename SparseFactor<Scalar>::Columns SparseFactor<Scalar>::Solve(const Eigen::Ref<const Columns>& columns) const {
  if (!is_regular_) {
    return Columns::Constant(columns.rows(), columns.cols(), Scalar(std::numeric_limits<double>::quiet_NaN()));
  }
  if (!factors_->panels && columns.cols() > 1) {
    return order_.inverse() * Columns(factors_->lu.solve(Columns(order_ * columns)));
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
