// SPDX-License-Identifier: Apache-2.0
#include "core/matrix_classes/minor_classes.h"

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/matrix_classes/p_matrix.h"
#include "core/matrix_classes/principal_minors.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

std::string MinorOfRows(const std::vector<Index>& indices) {
  return absl::StrCat("the principal minor of rows {", absl::StrJoin(indices, ", "), "}");
}

// The condition of one class on the sign of a minor of order k, and its result for the minors seen so far.
class SignTest {
 public:
  using Rule = bool (*)(int sign, Index order);

  SignTest(Rule rule, const char* all) : rule_(rule), all_(all) {}

  void See(const PrincipalMinor& minor) {
    if (refuted_) return;
    if (!minor.sign) {
      if (open_ == 0) open_ = minor.subset;
    } else if (!rule_(*minor.sign, minor.order)) {
      refuted_ = true;
      Keep(minor);
    } else if (std::abs(minor.value) < std::abs(value_)) {
      Keep(minor);
    }
  }

  bool refuted() const { return refuted_; }

  Fact Verdict() const {
    if (!refuted_ && open_ != 0) {
      return {Answer::kUnknown, absl::StrCat(MinorOfRows(IndicesOf(open_)), " is zero to working precision")};
    }
    Fact fact;
    fact.witness.indices = IndicesOf(subset_);
    fact.witness.value = value_;
    fact.answer = refuted_ ? Answer::kNo : Answer::kYes;
    fact.why = refuted_ ? absl::StrCat(MinorOfRows(fact.witness.indices), " is ", value_)
                        : absl::StrCat("all principal minors are ", all_, "; the smallest in size is ", value_);
    return fact;
  }

 private:
  void Keep(const PrincipalMinor& minor) {
    subset_ = minor.subset;
    value_ = minor.value;
  }

  Rule rule_;
  const char* all_;
  bool refuted_ = false;
  std::uint32_t open_ = 0;
  std::uint32_t subset_ = 0;
  double value_ = std::numeric_limits<double>::infinity();
};

int Alternating(Index order) { return order % 2 == 0 ? 1 : -1; }

MinorClasses ByAllMinors(const Matrix& M) {
  std::array tests = {
      SignTest([](int sign, Index) { return sign != 0; }, "nonzero"),
      SignTest([](int sign, Index) { return sign > 0; }, "positive"),
      SignTest([](int sign, Index) { return sign >= 0; }, "nonnegative"),
      SignTest([](int sign, Index) { return sign < 0; }, "negative"),
      SignTest([](int sign, Index order) { return sign == Alternating(order); }, "of sign (-1)^k"),
      SignTest([](int sign, Index order) { return sign == -Alternating(order); }, "of sign (-1)^(k+1)"),
  };
  VisitPrincipalMinors(M, [&](const PrincipalMinor& minor) {
    bool open = false;
    for (SignTest& test : tests) {
      test.See(minor);
      open |= !test.refuted();
    }
    return open;
  });
  return {tests[0].Verdict(), tests[1].Verdict(), tests[2].Verdict(),
          tests[3].Verdict(), tests[4].Verdict(), tests[5].Verdict()};
}

Fact BeyondExact(Index n) {
  return {Answer::kUnknown,
          absl::StrCat("n = ", n, " is beyond the exact test (n <= ", kMaxExactSize, ") and no other test decides")};
}

// TestPMatrix(), with unknown where rounding decided.
Fact CertainlyP(const Matrix& M) {
  Fact p = TestPMatrix(M);
  if (!p.no() || p.witness.value) return p;
  return {Answer::kUnknown, p.why};
}

Fact RefutedBy(const std::vector<Index>& indices, double minor) {
  Fact fact{Answer::kNo, absl::StrCat(MinorOfRows(indices), " is ", minor)};
  fact.witness.indices = indices;
  fact.witness.value = minor;
  return fact;
}

// Minors of order one and two, which refute most matrices.
void SeeSmallMinors(const Matrix& M, MinorClasses& known) {
  const auto see = [&](const std::vector<Index>& indices) {
    const PrincipalMinor minor = Determinant(M(indices, indices));
    if (!minor.sign) return;
    const int sign = *minor.sign;
    const auto refute = [&](Fact& fact, bool fits) {
      if (!fits && fact.answer == Answer::kUnknown) fact = RefutedBy(indices, minor.value);
    };
    refute(known.nondegenerate, sign != 0);
    refute(known.p0, sign >= 0);
    refute(known.n, sign < 0);
    refute(known.pn, sign == -Alternating(minor.order));
  };
  for (Index i = 0; i < M.rows(); ++i) see({i});
  for (Index i = 0; i < M.rows(); ++i) {
    LookForStop();
    for (Index j = i + 1; j < M.rows(); ++j) see({i, j});
  }
}

MinorClasses ByPolynomialTests(const Matrix& M) {
  const Fact open = BeyondExact(M.rows());
  MinorClasses known{open, CertainlyP(M), open, open, CertainlyP(-M), open};
  if (known.np.no()) {
    const auto order = static_cast<Index>(known.np.witness.indices.size());
    known.np = RefutedBy(known.np.witness.indices, Alternating(order) * *known.np.witness.value);
  } else if (known.np.yes()) {
    known.np.why = absl::StrCat("-M is a P-matrix: ", known.np.why);
  }
  if (known.p.yes() || known.np.yes()) known.nondegenerate = known.p.yes() ? known.p : known.np;
  if (known.p.yes()) known.p0 = known.p;
  SeeSmallMinors(M, known);
  return known;
}

}  // namespace

MinorClasses ClassifyByMinors(const Matrix& M) {
  return M.rows() <= kMaxExactSize ? ByAllMinors(M) : ByPolynomialTests(M);
}

}  // namespace dlcs
