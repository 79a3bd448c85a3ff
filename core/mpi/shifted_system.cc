// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/shifted_system.h"

#include <Eigen/Jacobi>
#include <algorithm>
#include <cmath>
#include <limits>

namespace dlcs {

void SumOverRanks(Eigen::Ref<Eigen::MatrixXcd> values, MpiTeam& team) {
  const Index count = values.size();
  Eigen::MatrixXcd own = values, parts(count, team.size());
  const auto numbers = static_cast<int>(2 * count);
  MPI_Allgather(own.data(), numbers, MPI_DOUBLE, parts.data(), numbers, MPI_DOUBLE, team.communicator());
  for (int rank = 1; rank < team.size(); ++rank) parts.col(0) += parts.col(rank);
  values = parts.col(0).reshaped(values.rows(), values.cols());
}

ShiftedSystem::ShiftedSystem(const RowMajorMatrix& A, const RowMajorMatrix& E, bool is_symmetric, const Ownership& rows,
                             MpiTeam& team)
    : is_symmetric_(is_symmetric),
      rows_(rows),
      team_(team),
      own_rows_(rows.rows(team.rank())),
      A_(A, rows, team),
      E_(E.rows() > 0 ? std::make_unique<const DistributedMatrix>(E, rows, team) : nullptr),
      basis_(A.rows(), kRestart + 1),
      parts_(A.rows(), 2),
      products_(A.rows(), 2),
      weighted_(A.rows(), 2),
      right_(A.rows()),
      left_(A.rows()) {}

void ShiftedSystem::PrepareCycle(double size_of_z) {
  const double shift = std::exp2(std::round(2 * std::log2(size_of_z)) / 2);
  if (shift == shift_) return;
  RowMajorMatrix K(A_.rows(), rows_.size());
  if (E_) {
    K = E_->Rows(rows_, own_rows_);
  } else {
    K.reserve(Eigen::VectorXi::Ones(K.rows()));
    for (Index i = 0; i < K.rows(); ++i) K.insert(i, own_rows_[static_cast<std::size_t>(i)]) = 1;
  }
  K = RowMajorMatrix(shift * K - A_.Rows(rows_, own_rows_));
  NumberedRows rows;
  for (Index i = 0; i < K.rows(); ++i) {
    for (RowMajorMatrix::InnerIterator entry(K, i); entry; ++entry) {
      rows.columns.push_back(static_cast<int>(rows_.number(entry.col())));
      rows.values.push_back(entry.value());
    }
    rows.numbers.push_back(static_cast<int>(rows_.first(team_.rank()) + i));
    rows.lengths.push_back(K.outerIndexPtr()[i + 1] - K.outerIndexPtr()[i]);
  }
  cycle_.reset();
  cycle_ = MultigridCycle::Make(team_.communicator(), rows, is_symmetric_);
  shift_ = shift;
}

void ShiftedSystem::Multiply(Complex z, const Eigen::VectorXcd& v, Eigen::VectorXcd& product) {
  parts_.col(0) = v.real();
  parts_.col(1) = v.imag();
  A_.Multiply(parts_, products_);
  if (E_) E_->Multiply(parts_, weighted_);
  const Matrix& weighted = E_ ? weighted_ : parts_;
  product.resize(v.size());
  product.real() = z.real() * weighted.col(0) - z.imag() * weighted.col(1) - products_.col(0);
  product.imag() = z.real() * weighted.col(1) + z.imag() * weighted.col(0) - products_.col(1);
}

void ShiftedSystem::Precondition(Eigen::VectorXcd& r) {
  right_ = r.real();
  cycle_->Apply(right_, left_);
  r.real() = left_;
  right_ = r.imag();
  cycle_->Apply(right_, left_);
  r.imag() = left_;
}

double ShiftedSystem::Norm(const Eigen::VectorXcd& v) {
  Eigen::MatrixXcd sum(1, 1);
  sum(0, 0) = v.squaredNorm();
  SumOverRanks(sum, team_);
  return std::sqrt(sum(0, 0).real());
}

bool ShiftedSystem::Solve(Complex z, const Eigen::VectorXcd& b, double tolerance, Eigen::VectorXcd& x) {
  constexpr int kMostCycles = 25;
  constexpr int kTimesLooser = 10;  // where rounding does not allow the tolerance
  PrepareCycle(std::abs(z));
  x.setZero(b.size());
  Eigen::VectorXcd w = b;
  Precondition(w);
  double size = Norm(w), size_of_x = size, before = std::numeric_limits<double>::infinity();
  error_ = size == 0 ? 0 : 1;  // 1 where it is no number, which no cycle changes
  for (int cycle = 0; cycle < kMostCycles && error_ > tolerance && 2 * size < before; ++cycle) {
    before = size;
    // ‖x‖ is not much less than ‖M b‖, which it is compared with in the first cycle.
    Cycle(z, w, size, 0.5 * tolerance * size_of_x, x);
    Multiply(z, x, w);
    w = b - w;
    Precondition(w);
    size = Norm(w);
    size_of_x = Norm(x);
    error_ = size / size_of_x;
  }
  return error_ <= kTimesLooser * tolerance;
}

// x + V y of least ‖w - M(zE - A) V y‖₂, with M(zE - A) V = V' H and the columns of V' orthonormal: classical Gram and
// Schmidt, twice, which takes two sums over the ranks for all columns.
void ShiftedSystem::Cycle(Complex z, const Eigen::VectorXcd& w, double size, double target, Eigen::VectorXcd& x) {
  Eigen::MatrixXcd H = Eigen::MatrixXcd::Zero(kRestart + 1, kRestart);
  Eigen::VectorXcd rotated = Eigen::VectorXcd::Zero(kRestart + 1), v = w / size, next;
  std::vector<Eigen::JacobiRotation<Complex>> rotations;
  rotated[0] = size;
  basis_.col(0) = v;
  Index steps = 0;
  while (steps < kRestart && std::abs(rotated[steps]) > target) {
    const Index k = steps++;
    ++iterations_;
    Multiply(z, v, next);
    Precondition(next);
    for (int pass = 0; pass < 2; ++pass) {
      Eigen::MatrixXcd along = basis_.leftCols(k + 1).adjoint() * next;
      SumOverRanks(along, team_);
      next.noalias() -= basis_.leftCols(k + 1) * along;
      H.col(k).head(k + 1) += along;
    }
    const double left = Norm(next);
    H(k + 1, k) = left;
    for (Index i = 0; i < k; ++i) H.col(k).applyOnTheLeft(i, i + 1, rotations[static_cast<std::size_t>(i)].adjoint());
    Complex length;
    rotations.emplace_back().makeGivens(H(k, k), H(k + 1, k), &length);
    H.col(k).applyOnTheLeft(k, k + 1, rotations.back().adjoint());
    rotated.applyOnTheLeft(k, k + 1, rotations.back().adjoint());
    if (!(left > 0)) break;  // x is found, or a number is not finite
    v = next / left;
    basis_.col(k + 1) = v;
  }
  const Eigen::VectorXcd y = H.topLeftCorner(steps, steps).triangularView<Eigen::Upper>().solve(rotated.head(steps));
  x.noalias() += basis_.leftCols(steps) * y;
}

}  // namespace dlcs
