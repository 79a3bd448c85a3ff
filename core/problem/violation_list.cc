// SPDX-License-Identifier: Apache-2.0
#include "core/problem/violation_list.h"

#include <cmath>
#include <utility>

#include "core/format_number.h"

namespace dlcs {
namespace {

std::string Bracketed(Index index) { return "[" + std::to_string(index) + "]"; }

std::string NonFiniteText(double value) { return NumberText(value) + "; every entry must be finite"; }

}  // namespace

void ViolationList::Add(std::string field, std::string description) {
  if (!full()) {
    violations_.push_back({std::move(field), std::move(description)});
  } else if (unlisted_++ == 0) {
    first_unlisted_field_ = std::move(field);
  }
}

void ViolationList::AddNonFiniteEntries(const Matrix& matrix, const std::string& field) {
  for (Index row = 0; row < matrix.rows(); ++row) {
    for (Index column = 0; column < matrix.cols(); ++column) {
      const double value = matrix(row, column);
      if (!std::isfinite(value)) Add(field + Bracketed(row) + Bracketed(column), NonFiniteText(value));
    }
  }
}

void ViolationList::AddNonFiniteEntries(const StructuredMatrix& matrix, const std::string& field) {
  if (matrix.is_dense()) return AddNonFiniteEntries(matrix.Dense(), field);
  if (const SparseMatrix* sparse = matrix.sparse()) return AddNonFiniteSparseEntries(*sparse, field);
  const std::vector<SparseMatrix>& factors = matrix.kronecker_sum()->factors;
  for (std::size_t k = 0; k < factors.size(); ++k) {
    AddNonFiniteSparseEntries(factors[k], field + ".kronecker_sum.factors" + Bracketed(static_cast<Index>(k)));
  }
}

void ViolationList::AddNonFiniteSparseEntries(const SparseMatrix& matrix, const std::string& field) {
  for (Index column = 0; column < matrix.outerSize(); ++column) {
    for (SparseMatrix::InnerIterator entry(matrix, column); entry; ++entry) {
      if (std::isfinite(entry.value())) continue;
      Add(field + Bracketed(entry.row()) + Bracketed(column), NonFiniteText(entry.value()));
    }
  }
}

void ViolationList::AddNonFiniteComponents(const Vector& vector, const std::string& field) {
  for (Index row = 0; row < vector.size(); ++row) {
    if (!std::isfinite(vector(row))) Add(field + Bracketed(row), NonFiniteText(vector(row)));
  }
}

void ViolationList::AddDisorder(const std::vector<double>& times, const std::string& field) {
  for (std::size_t k = 0; k < times.size(); ++k) {
    const std::string name = field + Bracketed(static_cast<Index>(k));
    if (!std::isfinite(times[k])) {
      Add(name, NumberText(times[k]) + "; every time must be finite");
    } else if (k > 0 && times[k] <= times[k - 1]) {
      Add(name,
          NumberText(times[k]) + "; must be greater than the time before it, " + NumberText(times[k - 1]));
    }
  }
}

std::vector<Violation> ViolationList::Take() && {
  if (unlisted_ > 0) {
    violations_.push_back({std::move(first_unlisted_field_),
                           "here and after it " + std::to_string(unlisted_) + " more rules are broken"});
  }
  return std::move(violations_);
}

void CheckBreakPoints(const std::vector<double>& times, double horizon, ViolationList& list) {
  list.AddDisorder(times, "break_points");
  for (std::size_t k = 0; k < times.size(); ++k) {
    if (times[k] <= 0 || times[k] >= horizon) {
      list.Add("break_points[" + std::to_string(k) + "]",
               NumberText(times[k]) + "; must lie inside (0, T) = (0, " + NumberText(horizon) + ")");
    }
  }
}

}  // namespace dlcs
