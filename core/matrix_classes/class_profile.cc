// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/class_profile.h"

#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/matrix_classes/exact_classes.h"
#include "core/matrix_classes/hidden_z.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/matrix_classes/s_matrix.h"
#include "core/matrix_classes/semicopositive_types.h"

namespace dlcs {
namespace {

// Every member of the stronger class is a member of the weaker class.
struct Implication {
  Fact& stronger;
  const char* name;
  Fact& weaker;
  const char* weaker_name;
};

bool IsOpen(const Fact& fact) { return fact.answer == Answer::kUnknown; }

void Follow(const Fact& known, std::string why, Fact& open) {
  if (!IsOpen(open) || IsOpen(known)) return;
  open = known;
  open.why = std::move(why);
}

// A matrix in a stronger class is in every weaker class; a matrix outside a weaker class is outside every stronger
// class. The list is ordered from strong to weak, so one pass in each direction is enough.
void Conclude(ClassProfile& known) {
  MinorClasses& minors = known.minors;
  QuadraticFormClasses& form = known.quadratic_form;
  SemicopositiveClasses& semicopositive = known.semicopositive;
  CopositiveClasses& copositive = known.copositive;
  const Implication implications[] = {
      {known.m, "a nonsingular M-matrix", minors.p, "P-matrix"},
      {known.m, "a nonsingular M-matrix", known.z, "Z-matrix"},
      {form.positive_definite, "positive definite", minors.p, "P-matrix"},
      {form.positive_definite, "positive definite", form.positive_semidefinite, "positive semidefinite matrix"},
      {form.positive_definite, "positive definite", copositive.strictly_copositive, "strictly copositive matrix"},
      {minors.p, "a P-matrix", minors.nondegenerate, "nondegenerate matrix"},
      {minors.n, "an N-matrix", minors.nondegenerate, "nondegenerate matrix"},
      {minors.np, "an NP-matrix", minors.nondegenerate, "nondegenerate matrix"},
      {minors.pn, "a PN-matrix", minors.nondegenerate, "nondegenerate matrix"},
      {minors.p, "a P-matrix", minors.p0, "P0-matrix"},
      {form.positive_semidefinite, "positive semidefinite", minors.p0, "P0-matrix"},
      {form.positive_semidefinite, "positive semidefinite", copositive.copositive, "copositive matrix"},
      {copositive.strictly_copositive, "strictly copositive", copositive.copositive, "copositive matrix"},
      {minors.p, "a P-matrix", semicopositive.strict, "strictly semicopositive matrix"},
      {copositive.strictly_copositive, "strictly copositive", semicopositive.strict, "strictly semicopositive matrix"},
      {known.type_one, "of type I", known.type_two, "matrix of type II"},
      {known.type_two, "of type II", known.type_three, "matrix of type III"},
      {known.type_three, "of type III", semicopositive.strict, "strictly semicopositive matrix"},
      {semicopositive.strict, "strictly semicopositive", semicopositive.weak, "semicopositive matrix"},
      {minors.p0, "a P0-matrix", semicopositive.weak, "semicopositive matrix"},
      {copositive.copositive, "copositive", semicopositive.weak, "semicopositive matrix"},
      {known.z, "a Z-matrix", known.hidden_z, "hidden Z-matrix"},
      {minors.nondegenerate, "nondegenerate", known.r0, "R0-matrix"},
      {semicopositive.strict, "strictly semicopositive", known.r0, "R0-matrix"},
      {semicopositive.strict, "strictly semicopositive", known.q, "Q-matrix"},
      {known.q, "a Q-matrix", known.s, "S-matrix"},
      {known.q, "a Q-matrix", known.q0, "Q0-matrix"},
      {known.hidden_z, "a hidden Z-matrix", known.q0, "Q0-matrix"},
      {form.positive_semidefinite, "positive semidefinite", known.q0, "Q0-matrix"},
  };
  for (const Implication& step : implications) {
    if (step.stronger.yes()) Follow(step.stronger, absl::StrCat("it is ", step.name), step.weaker);
  }
  for (auto step = std::rbegin(implications); step != std::rend(implications); ++step) {
    if (step->weaker.no()) Follow(step->weaker, absl::StrCat("it is no ", step->weaker_name), step->stronger);
  }
}

// If a column with a zero on the diagonal has no negative entry, its unit vector e_i solves LCP(0, M).
Fact RefuteR0(const Matrix& M) {
  for (Index i = 0; i < M.rows(); ++i) {
    if (M(i, i) != 0 || M.col(i).minCoeff() < 0) continue;
    Fact fact{Answer::kNo, absl::StrCat("the unit vector ", i, " solves LCP(0, M)")};
    fact.witness.z = Vector::Unit(M.rows(), i);
    return fact;
  }
  return {Answer::kUnknown, "none of the classes known to be sufficient applies"};
}

// Runs the exact tests for the classes that no other class decides.
void DecideExactly(const Matrix& M, ClassProfile& known) {
  const auto decide = [&M](Fact& fact, Index most, Fact (*test)(const Matrix&)) {
    if (IsOpen(fact) && M.rows() <= most) fact = test(M);
  };
  decide(known.r0, kMaxExactR0, ExactlyR0);
  decide(known.q, kMaxExactQ, ExactlyQ);
  if (known.q.yes()) known.q0 = known.q;
  decide(known.q0, kMaxExactQ, ExactlyQ0);
}

}  // namespace

ClassProfile ProfileOf(const Matrix& M) {
  const Fact open{Answer::kUnknown, "none of the classes known to be sufficient applies"};
  ClassProfile known;
  known.minors = ClassifyByMinors(M);
  known.quadratic_form = ClassifyQuadraticForm(M);
  known.z = TestZMatrix(M);
  known.hidden_z = TestHiddenZ(M);
  known.s = TestSMatrix(M);
  known.m = TestMMatrix(known.z, known.s);
  known.semicopositive = ClassifySemicopositive(M);
  known.copositive = ClassifyCopositive(M);
  known.type_one = TestSemicopositiveTypeI(M, known.semicopositive.strict);
  known.type_two = known.type_three = known.type_one;  // every no is one of type III
  known.r0 = RefuteR0(M);
  known.q = known.q0 = open;
  Conclude(known);
  DecideExactly(M, known);
  Conclude(known);
  return known;
}

}  // namespace dlcs
