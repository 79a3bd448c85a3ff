// SPDX-License-Identifier: Apache-2.0
#include "tests/hostile/lcp_cases.h"

#include <cmath>
#include <sstream>

namespace dlcs::testing {
namespace {

class Maker {
 public:
  explicit Maker(unsigned seed) : generator_(seed) {}

  std::int64_t Draw(std::int64_t low, std::int64_t high) {
    return std::uniform_int_distribution<std::int64_t>(low, high)(generator_);
  }

  IntegerMatrix Entries(std::size_t n, std::int64_t low, std::int64_t high, bool sparse) {
    IntegerMatrix M(n, IntegerVector(n));
    for (IntegerVector& row : M) {
      for (std::int64_t& entry : row) entry = sparse && Draw(0, 2) == 0 ? 0 : Draw(low, high);
    }
    return M;
  }

  // Diagonally dominant by rows, some of them barely.
  IntegerMatrix Dominant(IntegerMatrix M, std::int64_t least) {
    for (std::size_t i = 0; i < M.size(); ++i) {
      M[i][i] = Draw(least, least + 3);
      for (std::size_t j = 0; j < M.size(); ++j) M[i][i] += i == j ? 0 : std::abs(M[i][j]);
    }
    return M;
  }

  // G Gᵀ of some rank, and a skew matrix.
  IntegerMatrix Semidefinite(std::size_t n, std::size_t rank, bool with_skew) {
    const IntegerMatrix G = Entries(n, -2, 2, true), K = Entries(n, -4, 4, true);
    IntegerMatrix M(n, IntegerVector(n, 0));
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        for (std::size_t k = 0; k < rank; ++k) M[i][j] += G[i][k] * G[j][k];
        if (with_skew) M[i][j] += K[i][j] - K[j][i];
      }
    }
    return M;
  }

  // Y X⁻¹ with Z-matrices X, unit triangular, and Y.
  IntegerMatrix HiddenZ(std::size_t n) {
    IntegerMatrix M = Entries(n, -3, 0, true);
    for (std::size_t i = 0; i < n; ++i) M[i][i] = Draw(-1, 5);
    // M X = Y: columns from the left, X = I + U with U <= 0 above the diagonal.
    for (std::size_t j = 1; j < n; ++j) {
      for (std::size_t k = 0; k < j; ++k) {
        const std::int64_t u = Draw(-1, 0);
        for (std::size_t i = 0; i < n; ++i) M[i][j] -= u * M[i][k];
      }
    }
    return M;
  }

  // Block triangular with entries of one sign beside the blocks: P where the diagonal is positive.
  IntegerMatrix Triangular(std::size_t n, std::int64_t least_diagonal) {
    IntegerMatrix M = Entries(n, -9, 9, false);
    const bool upper = Draw(0, 1) == 0;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        if (upper ? j < i : j > i) M[i][j] = 0;
      }
      M[i][i] = Draw(least_diagonal, 5);
    }
    return M;
  }

  IntegerMatrix MatrixOf(LcpKind kind, std::size_t n) {
    switch (kind) {
      case LcpKind::kP:
        return Draw(0, 1) == 0 ? Dominant(Entries(n, -5, 5, true), 1) : Triangular(n, 1);
      case LcpKind::kZ: {
        IntegerMatrix M = Entries(n, -5, 0, true);
        for (std::size_t i = 0; i < n; ++i) M[i][i] = Draw(-2, 8);
        return M;
      }
      case LcpKind::kM:
        return Dominant(Entries(n, -5, 0, true), Draw(0, 1));
      case LcpKind::kPositiveSemidefinite:
        return Semidefinite(n, static_cast<std::size_t>(Draw(0, static_cast<std::int64_t>(n))), Draw(0, 1) == 0);
      case LcpKind::kSkew:
        return Semidefinite(n, 0, true);
      case LcpKind::kCopositive: {
        IntegerMatrix M = Semidefinite(n, 2, true);
        const IntegerMatrix more = Entries(n, 0, 4, true);
        for (std::size_t i = 0; i < n; ++i) {
          for (std::size_t j = 0; j < n; ++j) M[i][j] += more[i][j];
        }
        return M;
      }
      case LcpKind::kZeroDiagonal: {
        IntegerMatrix M = Entries(n, 0, 6, true);
        for (std::size_t i = 0; i < n; ++i) M[i][i] = 0;
        return M;
      }
      case LcpKind::kHiddenZ:
        return HiddenZ(n);
      case LcpKind::kSingularP0:
        return Draw(0, 1) == 0 ? Dominant(Entries(n, -5, 5, true), 0) : Triangular(n, 0);
      case LcpKind::kAny:
        break;
    }
    return Entries(n, -6, 6, Draw(0, 1) == 0);
  }

  // Any integers, or those of a solution with zeros in both y and w.
  IntegerVector RightHandSide(const IntegerMatrix& M) {
    IntegerVector q(M.size());
    if (Draw(0, 1) == 0) {
      for (std::int64_t& entry : q) entry = Draw(0, 3) == 0 ? 0 : Draw(-9, 9);
      return q;
    }
    for (std::size_t j = 0; j < M.size(); ++j) {
      const std::int64_t y = Draw(0, 2) == 0 ? Draw(1, 4) : 0;
      if (y == 0 && Draw(0, 1) == 0) q[j] += Draw(1, 5);
      for (std::size_t i = 0; i < M.size(); ++i) q[i] -= M[i][j] * y;
    }
    return q;
  }

 private:
  std::mt19937_64 generator_;
};

}  // namespace

LcpCase MakeLcpCase(unsigned seed) {
  Maker maker(seed);
  LcpCase lcp{static_cast<LcpKind>(seed % kNumLcpKinds), {}, {}};
  lcp.M = maker.MatrixOf(lcp.kind, static_cast<std::size_t>(maker.Draw(0, 9) == 0 ? 5 : maker.Draw(1, 4)));
  lcp.q = maker.RightHandSide(lcp.M);
  return lcp;
}

LcpUnits MakeUnits(Index n, int spread, bool congruent, std::mt19937_64& generator) {
  std::uniform_int_distribution<int> exponent(-spread, spread);
  LcpUnits units;
  for (Index i = 0; i < n; ++i) {
    units.row.push_back(exponent(generator));
    units.column.push_back(congruent ? units.row.back() : exponent(generator));
  }
  return units;
}

DoubleLcp InUnits(const LcpCase& lcp, const LcpUnits& units) {
  const Index n = static_cast<Index>(lcp.q.size());
  DoubleLcp result{Matrix(n, n), Vector(n)};
  for (Index i = 0; i < n; ++i) {
    result.q[i] = std::ldexp(static_cast<double>(lcp.q[i]), units.row[i]);
    for (Index j = 0; j < n; ++j)
      result.M(i, j) = std::ldexp(static_cast<double>(lcp.M[i][j]), units.row[i] + units.column[j]);
  }
  return result;
}

std::string AsFile(const DoubleLcp& lcp) {
  std::ostringstream text;
  text.precision(17);
  text << "{\"M\": [";
  for (Index i = 0; i < lcp.M.rows(); ++i) {
    text << (i > 0 ? ", [" : "[");
    for (Index j = 0; j < lcp.M.cols(); ++j) text << (j > 0 ? ", " : "") << lcp.M(i, j);
    text << "]";
  }
  text << "], \"q\": [";
  for (Index i = 0; i < lcp.q.size(); ++i) text << (i > 0 ? ", " : "") << lcp.q[i];
  text << "]}";
  return text.str();
}

}  // namespace dlcs::testing
