// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/relative_degree_section.h"

#include <string>
#include <utility>
#include <vector>

#include "core/matrix_classes/relative_degree.h"

namespace dlcs {

AnalysisSection RelativeDegreeSection(const Problem& problem, Selection selection) {
  const auto degrees = RelativeDegrees(problem.A, problem.B, problem.N, problem.M);
  const std::vector<Index> rows = ImpulsiveRows(degrees);
  std::vector<Index> unreached;
  for (std::size_t i = 0; i < degrees.size(); ++i) {
    if (!degrees[i]) unreached.push_back(static_cast<Index>(i));
  }

  Finding finding{"at-most-one", "y acts on every constraint through at most one integration", {}, ""};
  finding.fact.answer = rows.empty() && unreached.empty() ? Answer::kYes : Answer::kNo;
  finding.fact.why = rows.empty() ? "no constraint has a higher relative degree" : DescribeRows(rows, degrees);
  if (!unreached.empty()) finding.fact.why = "y never reaches " + DescribeRows(unreached, degrees);
  finding.fact.witness.indices = rows.empty() ? unreached : rows;

  AnalysisSection section{"relative-degree", "Relative degree", {}, {}, {}};
  section.findings.push_back(std::move(finding));
  if (IsAlwaysLipschitz(selection)) return section;  // M y is there, whatever the state does
  if (!rows.empty()) {
    section.warnings.push_back("y reaches " + DescribeRows(rows, degrees) +
                               " through two or more integrations only: where active, solutions need impulses.");
  }
  if (!unreached.empty()) {
    section.warnings.push_back("y never reaches " + DescribeRows(unreached, degrees) +
                               ": A, f, g and x0 alone decide whether N x + g >= 0 holds there.");
  }
  return section;
}

}  // namespace dlcs
