// SPDX-License-Identifier: Apache-2.0
#include "core/problem/number_range.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/format_number.h"
#include "core/linalg/norms.h"
#include "core/problem/mass_factor.h"

namespace dlcs {
namespace {

constexpr const char* kRule = "is beyond the largest number, 1.8e308; choose other units";

std::string Entry(const char* name, Index row, Index column) { return absl::StrCat(name, "[", row, "][", column, "]"); }
std::string Entry(const char* name, Index row) { return absl::StrCat(name, "[", row, "]"); }

// Where an entry of a matrix is.
struct Place {
  double value = 0;
  Index row = 0, column = 0;
};

// The entries of `matrix` that are not zero, for each.
template <typename Function>
void ForEntries(const StructuredMatrix& matrix, const Function& function) {
  const SparseMatrix sparse = matrix.Sparse();
  for (Index j = 0; j < sparse.outerSize(); ++j) {
    for (SparseMatrix::InnerIterator entry(sparse, j); entry; ++entry) {
      function(Place{entry.value(), entry.row(), j});
    }
  }
}

double MaxAbsOr0(const StructuredMatrix& matrix) { return matrix.size() == 0 ? 0 : matrix.MaxAbs(); }
double MaxAbsOr0(const Vector& vector) { return vector.size() == 0 ? 0 : MaxAbs(vector); }

// N B: the largest entry in a column of N and that in the row of B with its number.
void CheckProduct(const StructuredMatrix& N, const StructuredMatrix& B, ViolationList& list) {
  if (std::isfinite(MaxAbsOr0(N) * MaxAbsOr0(B))) return;
  std::vector<Place> of_column(static_cast<std::size_t>(N.cols())), of_row(static_cast<std::size_t>(B.rows()));
  const auto keep_larger = [](const Place& entry, Place& largest) {
    if (std::abs(entry.value) > std::abs(largest.value)) largest = entry;
  };
  ForEntries(N, [&](const Place& entry) { keep_larger(entry, of_column[static_cast<std::size_t>(entry.column)]); });
  ForEntries(B, [&](const Place& entry) { keep_larger(entry, of_row[static_cast<std::size_t>(entry.row)]); });
  for (std::size_t k = 0; k < of_row.size(); ++k) {
    const Place& n = of_column[k];
    const Place& b = of_row[k];
    if (std::isfinite(n.value * b.value)) continue;
    list.Add(Entry("N", n.row, n.column), absl::StrCat(NumberText(n.value), "; times ", Entry("B", b.row, b.column),
                                                       " = ", NumberText(b.value), ", in N B, it ", kRule));
    return;
  }
}

// A x0 and N x0.
void CheckImage(const StructuredMatrix& matrix, const char* name, const Vector& x0, ViolationList& list) {
  if (std::isfinite(MaxAbsOr0(matrix) * MaxAbsOr0(x0))) return;
  bool found = false;
  ForEntries(matrix, [&](const Place& entry) {
    if (found || std::isfinite(entry.value * x0[entry.column])) return;
    found = true;
    list.Add(Entry("x0", entry.column),
             absl::StrCat(NumberText(x0[entry.column]), "; times ", Entry(name, entry.row, entry.column), " = ",
                          NumberText(entry.value), ", in ", name, " x0, it ", kRule));
  });
}

// The diagonal of E; empty where there is no E, or where it is none.
Vector DiagonalMass(const Problem& problem) {
  if (!problem.has_mass() || !IsDiagonal(problem.E)) return {};
  Vector diagonal = Vector::Zero(problem.E.rows());
  ForEntries(problem.E, [&](const Place& entry) { diagonal[entry.row] += entry.value; });
  return diagonal;
}

void AddQuotient(const std::string& field, double value, Index row, double mass, ViolationList& list) {
  list.Add(field, absl::StrCat(NumberText(value), "; divided by ", Entry("E", row, row), " = ", NumberText(mass),
                               " it ", kRule));
}

void CheckQuotient(const StructuredMatrix& matrix, const char* name, const Vector& mass, ViolationList& list) {
  if (std::isfinite(MaxAbsOr0(matrix) / mass.cwiseAbs().minCoeff())) return;
  bool found = false;
  ForEntries(matrix, [&](const Place& entry) {
    if (found || std::isfinite(entry.value / mass[entry.row])) return;
    found = true;
    AddQuotient(Entry(name, entry.row, entry.column), entry.value, entry.row, mass[entry.row], list);
  });
}

// The value of a source; absent where it has none.
Vector ValueAt(const TimeFunction& function, Index size, double t) {
  Vector value = Vector::Zero(size);
  if (auto evaluator = TimeFunctionEvaluator::Create(function, size); evaluator.ok()) {
    evaluator->Evaluate(t, Side::kRight, value);
  }
  return value;
}

// The largest y_j is at least -q_i / Σ_j |M_ij| for q = N x0 + g(0) and each i.
void CheckStartOfY(const Problem& problem, ViolationList& list) {
  const Index n = problem.num_constraints();
  const Vector sizes = problem.M.AbsTimes(Vector::Ones(n));
  const Vector q = problem.N * problem.x0 + ValueAt(problem.g, n, 0);
  for (Index i = 0; i < n; ++i) {
    if (!(q[i] < 0) || sizes[i] == 0 || std::isfinite(q[i] / sizes[i])) continue;
    list.Add(Entry("M", i), absl::StrCat("sum of sizes ", NumberText(sizes[i]), "; (N x0 + g)[", i,
                                         "] = ", NumberText(q[i]), " at t = 0 divided by it, the least y, ", kRule));
    return;
  }
}

bool HasOperator(const Problem& problem) {
  for (const StructuredMatrix* matrix : {&problem.A, &problem.B, &problem.N, &problem.M, &problem.E}) {
    if (matrix->linear_operator() != nullptr) return true;
  }
  return false;
}

// `sizes`: those of the terms of sums of products of finite numbers. The first that overflows, as a sentence.
std::string FirstOverflow(const char* product, const Vector& sizes, double t) {
  for (Index i = 0; i < sizes.size(); ++i) {
    if (std::isfinite(sizes[i])) continue;
    return absl::StrCat("At t = ", FormatNumber(t), " component ", i, " of ", product, " ", kRule, ".");
  }
  return "";
}

}  // namespace

void CheckNumberRange(const Problem& problem, ViolationList& list) {
  if (HasOperator(problem)) return;
  CheckProduct(problem.N, problem.B, list);
  CheckImage(problem.A, "A", problem.x0, list);
  CheckImage(problem.N, "N", problem.x0, list);
  if (list.empty()) CheckStartOfY(problem, list);
  const Vector mass = DiagonalMass(problem);
  if (mass.size() == 0) return;
  CheckQuotient(problem.A, "A", mass, list);
  CheckQuotient(problem.B, "B", mass, list);
  const Vector f = ValueAt(problem.f, mass.size(), 0);
  for (Index i = 0; i < mass.size(); ++i) {
    if (std::isfinite(f[i] / mass[i])) continue;
    AddQuotient(Entry("f", i), f[i], i, mass[i], list);
    return;
  }
}

std::string OverflowAt(const Problem& problem, const Vector& x, const Vector& y, double t) {
  if (HasOperator(problem)) return "";
  const Vector X = x.cwiseAbs(), Y = y.cwiseAbs();
  const Vector F = ValueAt(problem.f, problem.num_states(), t).cwiseAbs();
  if (!X.allFinite() || !Y.allFinite() || !F.allFinite()) return "";
  const Vector Ax = problem.A.AbsTimes(X);
  std::string found = FirstOverflow("A x", Ax, t);
  if (found.empty()) found = FirstOverflow("N x", problem.N.AbsTimes(X), t);
  if (found.empty()) found = FirstOverflow("B y", problem.B.AbsTimes(Y), t);
  if (found.empty()) found = FirstOverflow("M y", problem.M.AbsTimes(Y), t);
  const Vector slope = Ax + problem.B.AbsTimes(Y) + F;
  if (found.empty()) found = FirstOverflow("x' = A x + B y + f", slope, t);
  if (found.empty()) found = FirstOverflow("A f", problem.A.AbsTimes(F), t);
  if (found.empty()) found = FirstOverflow("N f", problem.N.AbsTimes(F), t);
  if (found.empty()) found = FirstOverflow("N A x", problem.N.AbsTimes(Ax), t);
  return found;
}

std::string UnresolvedHorizon(const Problem& problem) {
  if (HasOperator(problem) || problem.A.size() == 0) return "";
  Vector rates = problem.A.AbsTimes(Vector::Ones(problem.num_states()));
  if (problem.has_mass()) {
    const Vector mass = DiagonalMass(problem);
    if (mass.size() == 0) return "";
    rates = rates.cwiseQuotient(mass.cwiseAbs());
  }
  const double T = problem.horizon, apart = T - std::nextafter(T, 0.0), fastest = 1 / rates.maxCoeff();
  if (!(apart > fastest)) return "";
  return absl::StrCat("T = ", NumberText(T), " is too long: numbers near it are ", FormatNumber(apart),
                      " apart, more than 1/\u2016A\u2016 = ", FormatNumber(fastest), "; choose a shorter T.");
}

}  // namespace dlcs
