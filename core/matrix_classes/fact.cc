// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/fact.h"

namespace dlcs {

const char* AnswerName(Answer answer) {
  switch (answer) {
    case Answer::kNo:
      return "no";
    case Answer::kYes:
      return "yes";
    case Answer::kUnknown:
      break;
  }
  return "unknown";
}

const char* ConstantKindName(ConstantKind kind) {
  switch (kind) {
    case ConstantKind::kUpperBound:
      return "upper-bound";
    case ConstantKind::kLowerBound:
      return "lower-bound";
    case ConstantKind::kEstimate:
      return "estimate";
    case ConstantKind::kExact:
      break;
  }
  return "exact";
}

}  // namespace dlcs
