// SPDX-License-Identifier: Apache-2.0
// ClassSection(): the classes of a matrix for people and programs.

#include <utility>

#include "core/analysis/class_profile.h"

namespace dlcs {

AnalysisSection ClassSection(const Matrix& M) {
  constexpr const char* kMinors = "section 1 of [Chen & Xiang]";
  constexpr const char* kTypes = "section 4 of [Shen & Pang]";
  ClassProfile known = ProfileOf(M);
  AnalysisSection section{
      .id = "matrix-class", .title = "Classes of M", .findings = {}, .constants = {}, .warnings = {}};
  const auto add = [&section](const char* id, const char* title, Fact& fact, const char* source) {
    section.findings.push_back({id, title, std::move(fact), source});
  };
  add("p", "P-matrix", known.minors.p, kMinors);
  add("z", "Z-matrix", known.z, "section 1 of [Chen & Xiang]");
  add("hidden-z", "hidden Z-matrix", known.hidden_z, "(4.10) of [Chen & Xiang]");
  add("m", "nonsingular M-matrix", known.m, "");
  add("positive-definite", "positive definite", known.quadratic_form.positive_definite, "");
  add("positive-semidefinite", "positive semidefinite", known.quadratic_form.positive_semidefinite, "");
  add("nondegenerate", "nondegenerate", known.minors.nondegenerate, kMinors);
  add("p0", "P0-matrix", known.minors.p0, "");
  add("n", "N-matrix", known.minors.n, kMinors);
  add("np", "NP-matrix", known.minors.np, kMinors);
  add("pn", "PN-matrix", known.minors.pn, kMinors);
  add("s", "S-matrix", known.s, "");
  add("strictly-semicopositive", "strictly semicopositive", known.semicopositive.strict,
      "(1) of [Shen & Pang]");
  add("type-i", "strictly semicopositive of type I", known.type_one, kTypes);
  add("type-ii", "strictly semicopositive of type II", known.type_two, kTypes);
  add("type-iii", "strictly semicopositive of type III", known.type_three, kTypes);
  add("r0", "R0-matrix: LCP(0, M) has the solution 0 alone", known.r0, "");
  add("q", "Q-matrix: LCP(q, M) has a solution for every q", known.q, "section 2 of [Chen & Xiang]");
  add("q0", "Q0-matrix: every feasible LCP(q, M) has a solution", known.q0, "");
  return section;
}

}  // namespace dlcs
