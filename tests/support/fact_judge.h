// SPDX-License-Identifier: Apache-2.0
// Compares the answers of the analysis with the truth.

#ifndef DLCS_TESTS_SUPPORT_FACT_JUDGE_H_
#define DLCS_TESTS_SUPPORT_FACT_JUDGE_H_

#include <gtest/gtest.h>

#include "core/matrix_classes/fact.h"
#include "core/types.h"

namespace dlcs::testing {

// Counts the answers, the unknown ones too.
class Judge {
 public:
  void Answers(const Fact& fact, bool truth, const char* what, const Matrix& M) {
    ++asked_;
    if (fact.answer == Answer::kUnknown) {
      ++unknown_;
      return;
    }
    ++(fact.yes() ? yes_ : no_);
    EXPECT_EQ(fact.yes(), truth) << what << ": " << fact.why << "\n" << M;
  }

  int yes() const { return yes_; }
  int no() const { return no_; }
  double share_of_unknown() const { return static_cast<double>(unknown_) / asked_; }

 private:
  int asked_ = 0, unknown_ = 0, yes_ = 0, no_ = 0;
};

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SUPPORT_FACT_JUDGE_H_
