// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/semiobservability.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/linalg/norms.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

using Sign = LexicographicRow::Sign;

// A vector with a bound on the error of each entry.
struct Enclosed {
  Vector value;
  Vector error;
};

// A product below this may have lost bits to underflow, which the error-free transformation does not see.
constexpr double kUnderflow = 1e-270;

Enclosed Multiply(const Matrix& matrix, const Enclosed& v) {
  Enclosed result{Vector::Zero(matrix.rows()), matrix.cwiseAbs() * v.error};
  for (Index i = 0; i < matrix.rows(); ++i) {
    double sum = 0, error = 0;
    for (Index j = 0; j < matrix.cols(); ++j) {
      const double a = matrix(i, j), b = v.value[j], product = a * b;
      if (a == 0 || b == 0) continue;
      error += std::abs(product) < kUnderflow ? kUnderflow : std::abs(std::fma(a, b, -product));
      const double next = sum + product, back = next - sum;
      error += std::abs((sum - (next - back)) + (product - back));
      sum = next;
    }
    result.value[i] = sum;
    // The bound is itself rounded: a part in 10⁸ more than covers that.
    result.error[i] = (result.error[i] + error) * (1 + 1e-8);
  }
  return result;
}

// The power of two next above `size`; 1 for 0.
double PowerAbove(double size) { return size > 0 ? std::exp2(std::ilogb(size) + 1) : 1; }

Sign Classify(double value, double error) {
  if (value > error) return Sign::kPositive;
  if (value < -error) return Sign::kNegative;
  return value == 0 && error == 0 ? Sign::kZero : Sign::kUndecided;
}

// `yes` unless a row has one of the `wrong` signs, which is then the witness and `verdict` on it, or is undecided.
Fact Decide(const std::vector<LexicographicRow>& rows, const char* yes, std::initializer_list<Sign> wrong,
            const char* verdict) {
  Fact fact{Answer::kYes, yes};
  for (Index i = 0; i < static_cast<Index>(rows.size()); ++i) {
    if (std::find(wrong.begin(), wrong.end(), rows[i].sign) != wrong.end()) {
      fact = {Answer::kNo, absl::StrCat(DescribeRow(rows[i], i), verdict)};
      fact.witness.indices = {i};
      fact.witness.value = rows[i].value;
      return fact;
    }
    if (rows[i].sign == Sign::kUndecided) {
      fact = {Answer::kUnknown, absl::StrCat(DescribeRow(rows[i], i), " is zero up to rounding")};
    }
  }
  return fact;
}

Fact DecideCone(const std::vector<LexicographicRow>& rows) {
  return Decide(rows, "the first nonzero entry of every row of (Cx0, CAx0, ...) is positive", {Sign::kNegative},
                " is negative");
}

Fact DecideUnobservable(const std::vector<LexicographicRow>& rows) {
  return Decide(rows, "C A^k x0 = 0 for all k, exactly", {Sign::kNegative, Sign::kPositive}, " is not zero");
}

}  // namespace

std::string DescribeRow(const LexicographicRow& row, Index index) {
  if (row.sign == Sign::kZero) return absl::StrCat("row ", index, ": all entries vanish");
  const std::string power = row.power == 0 ? "" : row.power == 1 ? "A " : absl::StrCat("A^", row.power, " ");
  return absl::StrCat("row ", index, ": (C ", power, "x0)[", index, "] = ", row.value,
                      row.error > 0 ? absl::StrCat(" ± ", row.error) : "", row.power > 0 ? " (scaled)" : "");
}

Semiobservability TestSemiobservability(const Matrix& C, const Matrix& A, const Vector& x0) {
  const Index num_states = A.rows();
  const Matrix scaled = A / PowerAbove(InfinityNorm(A));  // exact: a power of two
  Semiobservability result;
  result.rows.resize(C.rows());
  Enclosed state{x0, Vector::Zero(num_states)};
  for (int power = 0; power < num_states; ++power) {
    LookForStop();
    const Enclosed image = Multiply(C, state);
    for (Index i = 0; i < C.rows(); ++i) {
      LexicographicRow& row = result.rows[i];
      if (row.sign != Sign::kZero) continue;
      row = {Classify(image.value[i], image.error[i]), power, image.value[i], image.error[i]};
    }
    state = Multiply(scaled, state);
  }
  for (LexicographicRow& row : result.rows) {
    if (row.sign == Sign::kZero) row.power = static_cast<int>(num_states);
  }
  result.in_cone = DecideCone(result.rows);
  result.in_unobservable_space = DecideUnobservable(result.rows);
  return result;
}

}  // namespace dlcs
