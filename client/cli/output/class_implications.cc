// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/class_implications.h"

#include <algorithm>
#include <string_view>

namespace dlcs::client {
namespace {

// Chapter 3 of [Cottle, Pang, Stone 1992], The Linear Complementarity Problem; type I as in section 4 of [Shen & Pang].
// Single implications are enough if all classes are among the findings, but they may not be, so chains of two are
// listed too. There are no cycles.
constexpr ClassImplication kImplications[] = {
    {"m", "p"},
    {"m", "z"},
    {"m", "s"},
    {"m", "nondegenerate"},
    {"m", "p0"},
    {"m", "hidden-z"},
    {"m", "strictly-semicopositive"},
    {"z", "hidden-z"},
    {"z", "q0"},
    {"hidden-z", "q0"},
    {"positive-definite", "p"},
    {"positive-definite", "positive-semidefinite"},
    {"positive-definite", "strictly-copositive"},
    {"positive-definite", "strictly-semicopositive"},
    {"positive-semidefinite", "p0"},
    {"positive-semidefinite", "q0"},
    {"positive-semidefinite", "copositive"},
    {"p", "p0"},
    {"p", "nondegenerate"},
    {"p", "s"},
    {"p", "strictly-semicopositive"},
    {"p", "r0"},
    {"p", "q"},
    {"p", "q0"},
    {"n", "nondegenerate"},
    {"np", "nondegenerate"},
    {"pn", "nondegenerate"},
    {"nondegenerate", "r0"},
    {"p0", "semicopositive"},
    {"copositive", "semicopositive"},
    {"strictly-copositive", "copositive"},
    {"strictly-copositive", "strictly-semicopositive"},
    {"type-i", "type-ii"},
    {"type-i", "type-iii"},
    {"type-i", "strictly-semicopositive"},
    {"type-ii", "type-iii"},
    {"type-ii", "strictly-semicopositive"},
    {"type-iii", "strictly-semicopositive"},
    {"strictly-semicopositive", "semicopositive"},
    {"strictly-semicopositive", "s"},
    {"strictly-semicopositive", "r0"},
    {"strictly-semicopositive", "q"},
    {"q", "s"},
    {"q", "q0"},
};

bool Has(const v1::AnalysisSection& section, std::string_view id, v1::Answer answer) {
  return std::any_of(section.findings().begin(), section.findings().end(),
                     [&](const v1::Finding& finding) { return finding.id() == id && finding.answer() == answer; });
}

}  // namespace

std::span<const ClassImplication> ClassImplications() { return kImplications; }

bool Follows(const v1::Finding& finding, const v1::AnalysisSection& section) {
  return std::any_of(std::begin(kImplications), std::end(kImplications), [&](const ClassImplication& known) {
    if (finding.answer() == v1::ANSWER_YES)
      return known.wide == finding.id() && Has(section, known.narrow, v1::ANSWER_YES);
    if (finding.answer() == v1::ANSWER_NO)
      return known.narrow == finding.id() && Has(section, known.wide, v1::ANSWER_NO);
    return false;
  });
}

}  // namespace dlcs::client
