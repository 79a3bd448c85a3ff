// SPDX-License-Identifier: Apache-2.0
// The result of an analysis: statements with witnesses, and constants with their quality, in sections.
//
// Every part of the analysis gives one section. Sections are plain data: the wire format, the printed table and the
// JSON output need no code for any single finding.

#ifndef DLCS_CORE_ANALYSIS_FINDINGS_H_
#define DLCS_CORE_ANALYSIS_FINDINGS_H_

#include <optional>
#include <string>
#include <vector>

#include "core/matrix_classes/fact.h"

namespace dlcs {

// A statement about the problem: "M is a P-matrix".
struct Finding {
  std::string id;     // stable name for programs, unique in its section: "p", "strictly-semicopositive"
  std::string title;  // for people: "P-matrix"
  Fact fact;
  std::string source;  // "Theorem 9(b) of [Shen & Pang]"; empty where it is common knowledge
};

// A number or a short vector: "κ = 8".
struct Constant {
  std::string id;               // stable, unique in its section: "kappa"
  std::string symbol;           // "κ"
  std::string title;            // "Lipschitz constant of the right-hand side"
  std::optional<double> value;  // absent where it is not known; may be infinite
  ConstantKind kind = ConstantKind::kExact;
  std::string why;     // how it was found, or why it is absent
  std::string source;  // "(3.4) of [Chen & Xiang]"
};

struct AnalysisSection {
  std::string id;     // "matrix-class"
  std::string title;  // "Classes of M"
  std::vector<Finding> findings;
  std::vector<Constant> constants;
  std::vector<std::string> warnings;  // what the user should know before solving
};

}  // namespace dlcs

#endif  // DLCS_CORE_ANALYSIS_FINDINGS_H_
