// SPDX-License-Identifier: Apache-2.0
#include "core/problem/violation_list.h"

#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>

#include "absl/strings/cord.h"
#include "core/format_number.h"

namespace dlcs {
namespace {

std::string Bracketed(Index index) { return "[" + std::to_string(index) + "]"; }

std::string NonFiniteText(double value) { return NumberText(value) + "; every entry must be finite"; }

// A payload is a sequence of texts, field and description in turn, each as its length, a colon and its bytes.
void AppendText(const std::string& text, std::string& payload) {
  payload += std::to_string(text.size());
  payload += ':';
  payload += text;
}

// Removes the first text from `payload` and returns it, or nothing if there is none.
std::optional<std::string> TakeText(std::string_view& payload) {
  std::size_t size = 0;
  const char* const end = payload.data() + payload.size();
  const auto [next, error] = std::from_chars(payload.data(), end, size);
  if (error != std::errc() || next == end || *next != ':' || static_cast<std::size_t>(end - next) - 1 < size) return {};
  std::string text(next + 1, size);
  payload.remove_prefix(static_cast<std::size_t>(next + 1 - payload.data()) + size);
  return text;
}

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
      Add(name, NumberText(times[k]) + "; must be greater than the time before it, " + NumberText(times[k - 1]));
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

absl::Status StatusOf(const std::vector<Violation>& violations) {
  if (violations.empty()) return absl::OkStatus();
  std::string text;
  for (const Violation& violation : violations) {
    if (!text.empty()) text += '\n';
    if (!violation.field.empty()) text += violation.field + ": ";
    text += violation.description;
  }
  absl::Status status = absl::InvalidArgumentError(text);
  AttachViolations(violations, status);
  return status;
}

absl::Status InvalidField(std::string field, std::string description) {
  return StatusOf({{std::move(field), std::move(description)}});
}

void AttachViolations(const std::vector<Violation>& violations, absl::Status& status) {
  std::string payload;
  for (const Violation& violation : violations) {
    AppendText(violation.field, payload);
    AppendText(violation.description, payload);
  }
  status.SetPayload(kViolationsPayload, absl::Cord(payload));
}

std::vector<Violation> ViolationsOf(const absl::Status& status) {
  std::vector<Violation> violations;
  const auto payload = status.GetPayload(kViolationsPayload);
  if (!payload) return violations;
  const std::string bytes(*payload);
  std::string_view left = bytes;
  while (auto field = TakeText(left)) {
    auto description = TakeText(left);
    if (!description) break;
    violations.push_back({*std::move(field), *std::move(description)});
  }
  return violations;
}

}  // namespace dlcs
