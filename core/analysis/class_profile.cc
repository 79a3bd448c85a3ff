// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/class_profile.h"

#include <initializer_list>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/analysis/hidden_z.h"
#include "core/analysis/matrix_class.h"
#include "core/analysis/s_matrix.h"
#include "core/analysis/semicopositive.h"

namespace dlcs {
namespace {

struct Reason {
  const char* name;
  const Fact& fact;
};

// Yes by the first of `reasons` that holds, each of which suffices.
Fact AnyOf(std::initializer_list<Reason> reasons) {
  for (const auto& [name, fact] : reasons) {
    if (!fact.yes()) continue;
    Fact yes = fact;
    yes.why = absl::StrCat("it is ", name);
    return yes;
  }
  return {Answer::kUnknown, "none of the classes known to be sufficient applies"};
}

// Type I ⇒ II ⇒ III ⇒ strictly semicopositive.
Fact WeakerType(const Fact& type_one) {
  if (!type_one.yes()) return type_one;
  Fact fact = type_one;
  fact.why = absl::StrCat("of type I: ", type_one.why);
  return fact;
}

// A diagonal zero on top of a column >= 0: then e_i solves LCP(0, M).
Fact RefuteR0(const Matrix& M) {
  for (Index i = 0; i < M.rows(); ++i) {
    if (M(i, i) != 0 || M.col(i).minCoeff() < 0) continue;
    Fact fact{Answer::kNo, absl::StrCat("the unit vector ", i, " solves LCP(0, M)")};
    fact.witness.z = Vector::Unit(M.rows(), i);
    return fact;
  }
  return {Answer::kUnknown, ""};
}

Fact TestQ(const ClassProfile& known) {
  if (!known.s.no())
    return AnyOf(
        {{"a P-matrix", known.minors.p}, {"strictly semicopositive", known.strictly_semicopositive}});
  Fact no = known.s;
  no.why = absl::StrCat("it is no S-matrix: ", known.s.why);
  return no;
}

}  // namespace

ClassProfile ProfileOf(const Matrix& M) {
  ClassProfile known;
  known.minors = ClassifyByMinors(M);
  known.quadratic_form = ClassifyQuadraticForm(M);
  known.z = TestZMatrix(M);
  known.hidden_z = TestHiddenZ(M);
  known.s = TestSMatrix(M);
  known.m = TestMMatrix(known.z, known.s);
  known.strictly_semicopositive = TestStrictlySemicopositive(M);
  known.type_one = TestSemicopositiveTypeI(M);
  known.type_two = known.type_three = WeakerType(known.type_one);
  known.r0 = RefuteR0(M);
  if (!known.r0.no()) {
    known.r0 = AnyOf({{"nondegenerate", known.minors.nondegenerate},
                      {"strictly semicopositive", known.strictly_semicopositive}});
  }
  known.q = TestQ(known);
  known.q0 = AnyOf({{"a Q-matrix", known.q},
                    {"a Z-matrix", known.z},
                    {"positive semidefinite", known.quadratic_form.positive_semidefinite}});
  return known;
}

}  // namespace dlcs
