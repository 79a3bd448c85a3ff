// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/structured_matrix.h"

#include <algorithm>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "core/format_number.h"
#include "core/linalg/abs_times.h"
#include "core/linalg/diagonals.h"
#include "core/linalg/norms.h"
#include "core/linalg/panel_product.h"

namespace dlcs {

bool IsSymmetric(const SparseMatrix& M) {
  if (M.rows() != M.cols()) return false;
  const SparseMatrix difference = M - SparseMatrix(M.transpose());
  for (Index k = 0; k < difference.nonZeros(); ++k) {
    if (difference.valuePtr()[k] != 0) return false;  // NaN counts as different
  }
  return true;
}

namespace {

template <class... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};
template <class... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;

using Operator = std::shared_ptr<const LinearOperator>;

// The search for diagonals costs as much as several products.
constexpr Index kFewColumns = 8;

// The size of all that runs slower than factor `k`, and of all that runs faster.
struct Neighbors {
  Index slower = 1;
  Index faster = 1;
};

Neighbors NeighborsOf(const KroneckerSum& sum, std::size_t k) {
  Neighbors of;
  for (std::size_t i = 0; i < sum.factors.size(); ++i) {
    if (i < k) of.slower *= sum.factors[i].rows();
    if (i > k) of.faster *= sum.factors[i].rows();
  }
  return of;
}

// left = (F_1 ⊕ F_2 ⊕ ...) right, one column: for each factor and each index that runs slower a product of its
// transpose with a matrix whose columns are the values of that factor's index.
void MultiplyColumn(const KroneckerSum& sum, const double* right, Index size, double* left) {
  std::fill(left, left + size, 0.0);
  for (std::size_t k = 0; k < sum.factors.size(); ++k) {
    const SparseMatrix& factor = sum.factors[k];
    const Neighbors of = NeighborsOf(sum, k);
    if (of.faster == 1 && of.slower > kFewColumns) {  // columns of a matrix
      if (const auto diagonals = Diagonals::Of(factor)) {
        diagonals->AddProduct(Eigen::Map<const Matrix>(right, factor.cols(), of.slower),
                              Eigen::Map<Matrix>(left, factor.rows(), of.slower));
        continue;
      }
    }
    for (Index slow = 0; slow < of.slower; ++slow) {
      const Index begin = slow * factor.rows() * of.faster;
      for (Index j = 0; j < factor.cols(); ++j) {
        Eigen::Map<const Vector> from(right + begin + j * of.faster, of.faster);
        for (SparseMatrix::InnerIterator entry(factor, j); entry; ++entry) {
          Eigen::Map<Vector>(left + begin + entry.row() * of.faster, of.faster) += entry.value() * from;
        }
      }
    }
  }
}

// Sums |a_ij| v_j over the entries of a sparse matrix.
Vector AbsTimesSparse(const SparseMatrix& matrix, const Eigen::Ref<const Vector>& v) {
  Vector sums = Vector::Zero(matrix.rows());
  for (Index j = 0; j < matrix.outerSize(); ++j) {
    for (SparseMatrix::InnerIterator entry(matrix, j); entry; ++entry)
      sums[entry.row()] += std::abs(entry.value()) * v[j];
  }
  return sums;
}

// Entries off the diagonals of different factors never meet; their diagonals add up.
Vector AbsTimesKronecker(const KroneckerSum& sum, const Vector& v) {
  KroneckerSum off_diagonal;
  Vector diagonal = Vector::Zero(1);
  for (const SparseMatrix& factor : sum.factors) {
    const Vector of_factor = factor.diagonal(), before = diagonal;
    diagonal.resize(before.size() * of_factor.size());
    for (Index i = 0; i < before.size(); ++i) {
      diagonal.segment(i * of_factor.size(), of_factor.size()) = before[i] + of_factor.array();
    }
    off_diagonal.factors.push_back(factor.cwiseAbs());
    off_diagonal.factors.back().prune([](Index i, Index j, double) { return i != j; });
  }
  Vector sums(v.size());
  MultiplyColumn(off_diagonal, v.data(), v.size(), sums.data());
  return sums + diagonal.cwiseAbs().cwiseProduct(v);
}

SparseMatrix Compressed(SparseMatrix matrix) {
  matrix.makeCompressed();
  return matrix;
}

}  // namespace

Index KroneckerSum::size() const {
  Index size = 1;
  for (const SparseMatrix& factor : factors) {
    if (factor.rows() > 0 && size > std::numeric_limits<Index>::max() / factor.rows()) {
      return std::numeric_limits<Index>::max();
    }
    size *= factor.rows();
  }
  return size;
}

SparseMatrix KroneckerSum::Assemble() const {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < factors.size(); ++k) {
    const SparseMatrix& factor = factors[k];
    const Neighbors of = NeighborsOf(*this, k);
    for (Index slow = 0; slow < of.slower; ++slow) {
      for (Index j = 0; j < factor.outerSize(); ++j) {
        for (SparseMatrix::InnerIterator entry(factor, j); entry; ++entry) {
          for (Index fast = 0; fast < of.faster; ++fast) {
            entries.emplace_back((slow * factor.rows() + entry.row()) * of.faster + fast,
                                 (slow * factor.rows() + j) * of.faster + fast, entry.value());
          }
        }
      }
    }
  }
  SparseMatrix assembled(size(), size());
  assembled.setFromTriplets(entries.begin(), entries.end());
  return assembled;
}

SparseMatrix LinearOperator::Entries() const {
  throw std::logic_error("a matrix known by its products only has no entries");
}

struct StructuredMatrix::Expansion {
  std::once_flag made, searched;
  Matrix dense;
  std::optional<Diagonals> diagonals;
};

StructuredMatrix::StructuredMatrix(Matrix dense) : value_(std::move(dense)) {}

StructuredMatrix::StructuredMatrix(SparseMatrix sparse)
    : value_(Compressed(std::move(sparse))),
      rows_(this->sparse()->rows()),
      cols_(this->sparse()->cols()),
      expansion_(std::make_shared<Expansion>()) {}

StructuredMatrix::StructuredMatrix(std::shared_ptr<const LinearOperator> linear_operator)
    : value_(std::move(linear_operator)),
      rows_(std::get<Operator>(value_)->rows()),
      cols_(std::get<Operator>(value_)->cols()),
      expansion_(std::make_shared<Expansion>()) {}

const LinearOperator* StructuredMatrix::linear_operator() const {
  const Operator* const held = std::get_if<Operator>(&value_);
  return held ? held->get() : nullptr;
}

StructuredMatrix::StructuredMatrix(KroneckerSum sum)
    : value_(std::move(sum)), rows_(kronecker_sum()->size()), cols_(rows_), expansion_(std::make_shared<Expansion>()) {}

Index StructuredMatrix::nonzeros() const {
  return std::visit(Overloaded{[](const Matrix& dense) { return dense.size(); },
                               [](const SparseMatrix& sparse) { return sparse.nonZeros(); },
                               [](const KroneckerSum& sum) {
                                 Index count = 0;
                                 for (const SparseMatrix& factor : sum.factors) count += factor.nonZeros();
                                 return count;
                               },
                               [](const Operator& product) { return product->nonzeros(); }},
                    value_);
}

std::string StructuredMatrix::Describe() const {
  if (is_dense()) return "dense " + ShapeText(rows(), cols());
  if (linear_operator()) return "operator " + ShapeText(rows(), cols());
  if (sparse()) return "sparse " + ShapeText(rows(), cols()) + " (" + std::to_string(nonzeros()) + " nonzeros)";
  std::string text = "Kronecker sum of ";
  for (const SparseMatrix& factor : kronecker_sum()->factors) {
    if (text.back() != ' ') text += " and ";
    text += ShapeText(factor.rows(), factor.cols());
  }
  return text;
}

const Matrix& StructuredMatrix::Dense() const {
  if (const auto* dense = std::get_if<Matrix>(&value_)) return *dense;
  std::call_once(expansion_->made, [this] { expansion_->dense = Matrix(Sparse()); });
  return expansion_->dense;
}

SparseMatrix StructuredMatrix::Sparse() const {
  return std::visit(Overloaded{[](const Matrix& dense) { return SparseMatrix(dense.sparseView(0, 0)); },
                               [](const SparseMatrix& sparse) { return sparse; },
                               [](const KroneckerSum& sum) { return sum.Assemble(); },
                               [](const Operator& product) { return product->Entries(); }},
                    value_);
}

Vector StructuredMatrix::Diagonal() const {
  if (is_dense()) return Dense().diagonal();
  if (sparse() != nullptr) return sparse()->diagonal();
  return Vector::Zero(std::min(rows(), cols()));
}

Vector StructuredMatrix::AbsTimes(const Eigen::Ref<const Vector>& v) const {
  return std::visit(Overloaded{[&](const Matrix& dense) { return dlcs::AbsTimes(dense, v); },
                               [&](const SparseMatrix& sparse) { return AbsTimesSparse(sparse, v); },
                               [&](const KroneckerSum& sum) { return AbsTimesKronecker(sum, v); },
                               [&](const Operator& product) { return product->AbsTimes(v); }},
                    value_);
}

double StructuredMatrix::InfinityNorm() const {
  if (is_dense()) return dlcs::InfinityNorm(Dense());
  return dlcs::MaxAbs(AbsTimes(Vector::Ones(cols())));
}

double StructuredMatrix::MaxAbs() const {
  if (is_dense()) return dlcs::MaxAbs(Dense());
  const SparseMatrix entries = Sparse();
  return dlcs::MaxAbs(Eigen::Map<const Vector>(entries.valuePtr(), entries.nonZeros()));
}

bool StructuredMatrix::IsZero() const { return MaxAbs() == 0; }

bool StructuredMatrix::AllFinite() const { return std::isfinite(MaxAbs()); }

const Diagonals* StructuredMatrix::StoredDiagonals(const SparseMatrix& sparse) const {
  std::call_once(expansion_->searched, [&] { expansion_->diagonals = Diagonals::Of(sparse); });
  return expansion_->diagonals ? &*expansion_->diagonals : nullptr;
}

void StructuredMatrix::Multiply(const Eigen::Ref<const Matrix>& right, Eigen::Ref<Matrix> left) const {
  std::visit(Overloaded{[&](const Matrix& dense) {
                          ForPanels(right.cols(), dense.size(), [&](Index begin, Index count) {
                            left.middleCols(begin, count).noalias() = dense * right.middleCols(begin, count);
                          });
                        },
                        [&](const SparseMatrix& sparse) {
                          const Diagonals* diagonals = right.cols() > kFewColumns ? StoredDiagonals(sparse) : nullptr;
                          if (diagonals) return diagonals->Multiply(right, left);
                          left.noalias() = sparse * right;
                        },
                        [&](const KroneckerSum& sum) {
                          for (Index k = 0; k < right.cols(); ++k) {
                            MultiplyColumn(sum, right.col(k).data(), cols_, left.col(k).data());
                          }
                        },
                        [&](const Operator& product) { product->Multiply(right, left); }},
             value_);
}

Matrix StructuredMatrix::operator*(const StructuredMatrix& right) const {
  if (right.is_dense()) return *this * right.Dense();
  if (is_dense()) return Dense() * right.Sparse();
  return Matrix(SparseMatrix(Sparse() * right.Sparse()));
}

double InfinityNorm(const StructuredMatrix& matrix) { return matrix.InfinityNorm(); }

}  // namespace dlcs
