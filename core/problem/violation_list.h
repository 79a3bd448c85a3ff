// SPDX-License-Identifier: Apache-2.0
// Collects violations of the rules for the input, up to a maximum number, and carries them in a status.

#ifndef DLCS_CORE_PROBLEM_VIOLATION_LIST_H_
#define DLCS_CORE_PROBLEM_VIOLATION_LIST_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/linalg/structured_matrix.h"
#include "core/types.h"

namespace dlcs {

class ViolationList {
 public:
  // Enough to correct a problem by hand; a matrix full of NaN must not become a million strings.
  static constexpr Index kMaxListed = 200;

  void Add(std::string field, std::string description);

  // Every entry of `matrix` that is not finite, as field[row][column]; of `vector`, as field[row].
  void AddNonFiniteEntries(const Matrix& matrix, const std::string& field);
  // The same for a matrix with structure; entries of the factors of a Kronecker sum are
  // field.kronecker_sum.factors[k][row][column].
  void AddNonFiniteEntries(const StructuredMatrix& matrix, const std::string& field);
  void AddNonFiniteComponents(const Vector& vector, const std::string& field);

  // Times that are not finite, or not greater than the one before, as field[k].
  void AddDisorder(const std::vector<double>& times, const std::string& field);

  bool empty() const { return violations_.empty(); }
  bool full() const { return static_cast<Index>(violations_.size()) >= kMaxListed; }

  // The first kMaxListed violations in the order of Add(); if there were more, one further entry counts the rest.
  std::vector<Violation> Take() &&;

 private:
  void AddNonFiniteSparseEntries(const SparseMatrix& matrix, const std::string& field);

  std::vector<Violation> violations_;
  Index unlisted_ = 0;
  std::string first_unlisted_field_;
};

// Checks `times` as break points of a problem on [0, horizon]: adds times out of order or outside (0, horizon), as
// break_points[k].
void CheckBreakPoints(const std::vector<double>& times, double horizon, ViolationList& list);

// OK without `violations`; otherwise InvalidArgument that carries them. The message has them too, "field: description",
// one per line.
absl::Status StatusOf(const std::vector<Violation>& violations);
// InvalidArgument with one violation.
absl::Status InvalidField(std::string field, std::string description);

// The violations that `status` carries; empty where it carries none.
std::vector<Violation> ViolationsOf(const absl::Status& status);
// Replaces the violations that `status`, which is not OK, carries by `violations`.
void AttachViolations(const std::vector<Violation>& violations, absl::Status& status);

// The key of the status payload that carries violations, for code that converts it.
inline constexpr char kViolationsPayload[] = "dlcs/violations";

}  // namespace dlcs

#endif  // DLCS_CORE_PROBLEM_VIOLATION_LIST_H_
