// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/class_section.h"

#include <utility>

#include "core/matrix_classes/class_profile.h"
#include "core/matrix_classes/semicopositive_constant.h"

namespace dlcs {
namespace {

constexpr const char* kSigma = "(3) of [Shen & Pang]";

// How strictly M is semicopositive.
void AddConstants(const Matrix& M, AnalysisSection& section) {
  const LowerBound below = SemicopositiveConstant(M);
  const UpperBound above = SemicopositiveConstantAbove(M);
  const char* title = "max z_i (Mz)_i >= σ ‖z‖² for z >= 0, in the ∞-norm";
  const auto add = [&section](const char* id, const char* symbol, const char* what, double value, ConstantKind kind,
                              std::string why, const char* source) {
    section.constants.push_back({id, symbol, what, value, kind, std::move(why), source});
  };
  if (below.value >= above.value) {
    add("sigma", "σ", title, above.value, ConstantKind::kExact, below.why, kSigma);
  } else {
    if (below.value > 0) add("sigma", "σ", title, below.value, ConstantKind::kLowerBound, below.why, kSigma);
    add("sigma-above", "σ", "the same from above", above.value, ConstantKind::kUpperBound,
        "a z >= 0 with this value was found by descent", kSigma);
  }
  if (const LowerBound type_one = TypeOneConstant(M); type_one.value > 0) {
    add("sigma-type-one", "σ of type I", "max ∫ v_i' (Mv)_i >= σ ‖v‖² for nondecreasing v, in the ∞-norm",
        type_one.value, ConstantKind::kLowerBound, type_one.why, "section 4 of [Shen & Pang]");
  }
}

}  // namespace

AnalysisSection ClassSection(const Matrix& M) {
  constexpr const char* kNoSource = "";
  ClassProfile known = ProfileOf(M);
  AnalysisSection section{
      .id = "matrix-class", .title = "Classes of M", .findings = {}, .constants = {}, .warnings = {}};
  const auto add = [&section](const char* id, const char* title, const Fact& fact, const char* source) {
    section.findings.push_back({id, title, fact, source});
  };
  add("m", "nonsingular M-matrix", known.m, kNoSource);
  add("positive-definite", "positive definite", known.quadratic_form.positive_definite, kNoSource);
  add("p", "P-matrix", known.minors.p, kNoSource);
  add("z", "Z-matrix", known.z, kNoSource);
  add("hidden-z", "hidden Z-matrix: M X = Y with Z-matrices X, Y", known.hidden_z, "(4.10) of [Chen & Xiang]");
  add("positive-semidefinite", "positive semidefinite", known.quadratic_form.positive_semidefinite, kNoSource);
  add("strictly-copositive", "strictly copositive", known.copositive.strictly_copositive, kNoSource);
  add("type-i", "type I: strictly semicopositive for integrals, with one constant", known.type_one,
      "section 4 of [Shen & Pang]");
  add("type-ii", "type II: the same, with a constant for each function", known.type_two, kNoSource);
  add("type-iii", "type III: the same, without a constant", known.type_three, kNoSource);
  add("strictly-semicopositive", "strictly semicopositive", known.semicopositive.strict, "(1) of [Shen & Pang]");
  add("nondegenerate", "nondegenerate", known.minors.nondegenerate, kNoSource);
  add("p0", "P0-matrix", known.minors.p0, kNoSource);
  add("copositive", "copositive", known.copositive.copositive, kNoSource);
  add("semicopositive", "semicopositive", known.semicopositive.weak, kNoSource);
  add("n", "N-matrix: all principal minors are negative", known.minors.n, "section 1 of [Chen & Xiang]");
  add("np", "NP-matrix: those of order k have the sign (-1)^k", known.minors.np, kNoSource);
  add("pn", "PN-matrix: those of order k have the sign (-1)^(k+1)", known.minors.pn, kNoSource);
  add("s", "S-matrix: some z >= 0 has Mz > 0", known.s, kNoSource);
  add("r0", "R0-matrix: LCP(0, M) has the solution 0 alone", known.r0, kNoSource);
  add("q", "Q-matrix: LCP(q, M) has a solution for every q", known.q, kNoSource);
  add("q0", "Q0-matrix: every feasible LCP(q, M) has a solution", known.q0, kNoSource);
  if (!known.semicopositive.strict.no()) AddConstants(M, section);
  return section;
}

}  // namespace dlcs
