// SPDX-License-Identifier: Apache-2.0
#include "tests/hostile/exact_mode.h"

#include <algorithm>
#include <cmath>

namespace dlcs::hostile {

namespace {

constexpr double kZeroPivot = 1e-24;  // of the sum of absolute values of its row; sums lose 1e-31
constexpr double kSeriesNorm = 0.25;
constexpr int kSeriesTerms = 24;  // 0.25^24 / 24! < 1e-37

DenseMatrix FromEigen(const Eigen::MatrixXd& matrix) {
  DenseMatrix result(static_cast<int>(matrix.rows()), static_cast<int>(matrix.cols()));
  for (int i = 0; i < result.rows(); ++i) {
    for (int j = 0; j < result.cols(); ++j) result(i, j) = matrix(i, j);
  }
  return result;
}

double PowerOfTwo(double value) { return value > 0 ? std::exp2(-std::round(std::log2(value))) : 1; }

// W with s' = W s for the functions of `system`.
DenseMatrix SourceDerivative(const System& system) {
  const int size = static_cast<int>(system.functions.size());
  DenseMatrix W(size, size);
  for (int k = 0; k < size; ++k) {
    const SourceFunction& function = system.functions[k];
    switch (function.kind) {
      case SourceFunction::Kind::kPower:
        for (int j = 0; j < size; ++j) {
          if (function.power > 0 && system.functions[j].kind == SourceFunction::Kind::kPower &&
              system.functions[j].power == function.power - 1)
            W(k, j) = function.power;
        }
        break;
      case SourceFunction::Kind::kSine:
        W(k, k + 1) = function.rate;
        break;
      case SourceFunction::Kind::kCosine:
        W(k, k - 1) = -function.rate;
        break;
      case SourceFunction::Kind::kExponential:
        W(k, k) = function.rate;
        break;
    }
  }
  return W;
}

// The least ∞-norm that a scaling by powers of two finds [Parlett & Reinsch 1969].
double BalancedNorm(const DenseMatrix& matrix) {
  const int size = matrix.rows();
  std::vector<double> a(static_cast<size_t>(size) * size);
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) a[static_cast<size_t>(i) * size + j] = std::abs(ToDouble(matrix(i, j)));
  }
  for (int sweep = 0; sweep < 60; ++sweep) {
    bool changed = false;
    for (int i = 0; i < size; ++i) {
      double row = 0, column = 0;
      for (int j = 0; j < size; ++j) {
        if (j == i) continue;
        row += a[static_cast<size_t>(i) * size + j];
        column += a[static_cast<size_t>(j) * size + i];
      }
      double factor = 1;
      if (row > 0 && column > 0) {
        factor = PowerOfTwo(std::sqrt(column / row));
      } else if (row > 0 || column > 0) {
        factor = row > 0 ? 0x1p40 : 0x1p-40;  // one side only: as small as one likes
        if (std::max(row, column) < 1e-30) factor = 1;
      }
      // Entry (i, j) divided by the factor of i, times that of j.
      factor = 1 / factor;
      if (factor == 1) continue;
      changed = true;
      for (int j = 0; j < size; ++j) {
        if (j == i) continue;
        a[static_cast<size_t>(i) * size + j] *= factor;
        a[static_cast<size_t>(j) * size + i] /= factor;
      }
    }
    if (!changed) break;
  }
  double norm = 0;
  for (int i = 0; i < size; ++i) {
    double sum = 0;
    for (int j = 0; j < size; ++j) sum += a[static_cast<size_t>(i) * size + j];
    norm = std::max(norm, sum);
  }
  return norm;
}

}  // namespace

RegimeSystem::RegimeSystem(const System& system, const SmoothInterval& interval)
    : num_states(system.num_states()), num_pairs(system.num_pairs()) {
  const int sources = static_cast<int>(system.functions.size());
  size = num_states + sources;
  W = SourceDerivative(system);
  A = DenseMatrix(num_states, size);
  for (int i = 0; i < num_states; ++i) {
    for (int j = 0; j < num_states; ++j) A(i, j) = system.A(i, j);
    for (int j = 0; j < sources; ++j) A(i, num_states + j) = interval.F(i, j);
  }
  B = FromEigen(system.B);
  M = FromEigen(system.M);
  N = DenseMatrix(num_pairs, size);
  for (int i = 0; i < num_pairs; ++i) {
    for (int j = 0; j < num_states; ++j) N(i, j) = system.N(i, j);
    for (int j = 0; j < sources; ++j) N(i, num_states + j) = interval.G(i, j);
  }

  std::vector<double> rows(num_pairs, 1), columns(num_pairs, 1);
  for (int sweep = 0; sweep < 20; ++sweep) {
    for (int i = 0; i < num_pairs; ++i) {
      double largest = 0;
      for (int j = 0; j < num_pairs; ++j) largest = std::max(largest, std::abs(system.M(i, j)) * rows[i] * columns[j]);
      rows[i] *= PowerOfTwo(std::sqrt(largest));
    }
    for (int j = 0; j < num_pairs; ++j) {
      double largest = 0;
      for (int i = 0; i < num_pairs; ++i) largest = std::max(largest, std::abs(system.M(i, j)) * rows[i] * columns[j]);
      columns[j] *= PowerOfTwo(std::sqrt(largest));
    }
  }
  for (int i = 0; i < num_pairs; ++i) {
    for (int j = 0; j < size; ++j) N(i, j) *= rows[i];
    for (int j = 0; j < num_pairs; ++j) M(i, j) *= Real(rows[i]) * Real(columns[j]);
    for (int j = 0; j < num_states; ++j) B(j, i) *= columns[i];
  }
  unit_of_y = columns;
  for (const double row : rows) unit_of_w.push_back(1 / row);
}

namespace {

// Rows P y + R z = 0 of the active pairs, eliminated with complete pivoting; rows that lose all of P are constraints of
// z, and are replaced by their derivative once.
class Elimination {
 public:
  Elimination(const RegimeSystem& regime, const std::vector<int>& pairs) : regime_(regime), pairs_(pairs) {
    const int k = static_cast<int>(pairs.size());
    for (int a = 0; a < k; ++a) {
      Row row{Column(k), Column(regime.size), 0};
      for (int b = 0; b < k; ++b) row.p[b] = regime.M(pairs[a], pairs[b]);
      for (int j = 0; j < regime.size; ++j) row.r[j] = regime.N(pairs[a], j);
      row.size = SizeOf(row.p);
      rows_.push_back(row);
    }
    column_of_.assign(k, -1);
  }

  // y = result z, a row for each of the pairs; nothing if it is not determined.
  std::optional<DenseMatrix> Solve(std::vector<Column>& invariants) {
    Pivot();
    const int k = static_cast<int>(pairs_.size());
    for (int a = 0; a < k; ++a) {
      if (column_of_[a] >= 0) continue;
      invariants.push_back(rows_[a].r);
      Differentiate(rows_[a]);
      for (int b = 0; b < k; ++b) {
        if (column_of_[b] >= 0) Eliminate(rows_[b], column_of_[b], rows_[a]);
      }
    }
    Pivot();
    DenseMatrix y(k, regime_.size);
    for (int a = 0; a < k; ++a) {
      if (column_of_[a] < 0) return std::nullopt;
      for (int j = 0; j < regime_.size; ++j) y(column_of_[a], j) = -rows_[a].r[j] / rows_[a].p[column_of_[a]];
    }
    return y;
  }

 private:
  struct Row {
    Column p, r;
    double size;  // of p as it came: what zero is measured against
  };

  static double SizeOf(const Column& p) {
    double size = 0;
    for (const Real& entry : p) size += std::abs(ToDouble(entry));
    return size;
  }

  void Pivot() {
    const int k = static_cast<int>(pairs_.size());
    while (true) {
      int best_row = -1, best_column = -1;
      double best = kZeroPivot;
      for (int a = 0; a < k; ++a) {
        if (column_of_[a] >= 0 || rows_[a].size == 0) continue;
        for (int b = 0; b < k; ++b) {
          const double value = std::abs(ToDouble(rows_[a].p[b])) / rows_[a].size;
          if (std::find(column_of_.begin(), column_of_.end(), b) == column_of_.end() && value > best) {
            best = value;
            best_row = a;
            best_column = b;
          }
        }
      }
      if (best_row < 0) return;
      column_of_[best_row] = best_column;
      for (int a = 0; a < k; ++a) {
        if (a != best_row) Eliminate(rows_[best_row], best_column, rows_[a]);
      }
    }
  }

  static void Eliminate(const Row& pivot, int column, Row& row) {
    const Real factor = row.p[column] / pivot.p[column];
    if (IsZero(factor)) return;
    for (size_t b = 0; b < row.p.size(); ++b) row.p[b] -= factor * pivot.p[b];
    for (size_t j = 0; j < row.r.size(); ++j) row.r[j] -= factor * pivot.r[j];
    row.p[column] = 0;
    double change = 0;
    for (size_t b = 0; b < row.p.size(); ++b) change += std::abs(ToDouble(factor * pivot.p[b]));
    row.size = std::max(row.size, change);
  }

  void Differentiate(Row& row) const {
    const Column c = row.r;
    const int m = regime_.num_states;
    row.r.assign(regime_.size, 0);
    row.size = 0;
    for (size_t b = 0; b < pairs_.size(); ++b) {
      row.p[b] = 0;
      for (int i = 0; i < m; ++i) {
        row.p[b] += c[i] * regime_.B(i, pairs_[b]);
        row.size += std::abs(ToDouble(c[i] * regime_.B(i, pairs_[b])));
      }
    }
    for (int i = 0; i < m; ++i) {
      for (int j = 0; j < regime_.size; ++j) row.r[j] += c[i] * regime_.A(i, j);
    }
    for (int i = 0; i < regime_.size - m; ++i) {
      for (int j = 0; j < regime_.size - m; ++j) row.r[m + j] += c[m + i] * regime_.W(i, j);
    }
  }

  const RegimeSystem& regime_;
  const std::vector<int>& pairs_;
  std::vector<Row> rows_;
  std::vector<int> column_of_;  // of each row, where it has been pivoted on
};

// Whether M_SS is a nonsingular M-matrix: then the y of the basis is the least element wherever it is feasible.
bool IsNonsingularMMatrix(const RegimeSystem& regime, const std::vector<int>& pairs) {
  const int k = static_cast<int>(pairs.size());
  DenseMatrix a(k, k);
  for (int i = 0; i < k; ++i) {
    for (int j = 0; j < k; ++j) {
      a(i, j) = regime.M(pairs[i], pairs[j]);
      if (i != j && a(i, j) > Real(0)) return false;
    }
  }
  for (int p = 0; p < k; ++p) {  // all pivots positive
    double size = 0;
    for (int j = 0; j < k; ++j) size += std::abs(ToDouble(regime.M(pairs[p], pairs[j])));
    if (!(ToDouble(a(p, p)) > kZeroPivot * size)) return false;
    for (int i = p + 1; i < k; ++i) {
      const Real factor = a(i, p) / a(p, p);
      for (int j = p; j < k; ++j) a(i, j) -= factor * a(p, j);
    }
  }
  return true;
}

}  // namespace

std::shared_ptr<Mode> Mode::Create(const RegimeSystem& regime, unsigned active, double horizon) {
  std::vector<int> pairs;
  for (int i = 0; i < regime.num_pairs; ++i) {
    if (active >> i & 1u) pairs.push_back(i);
  }
  std::shared_ptr<Mode> mode(new Mode);
  std::optional<DenseMatrix> y = Elimination(regime, pairs).Solve(mode->invariants_);
  if (!y) return nullptr;
  mode->active_ = active;
  mode->horizon_ = horizon;
  const int m = regime.num_states, n = regime.num_pairs, size = regime.size;
  mode->y_ = DenseMatrix(n, size);
  for (size_t a = 0; a < pairs.size(); ++a) {
    for (int j = 0; j < size; ++j) mode->y_(pairs[a], j) = (*y)(static_cast<int>(a), j);
  }
  mode->signs_ = mode->y_;
  for (int i = 0; i < n; ++i) {
    if (active >> i & 1u) continue;
    for (int j = 0; j < size; ++j) {
      Real w = regime.N(i, j);
      for (int pair : pairs) w += regime.M(i, pair) * mode->y_(pair, j);
      mode->signs_(i, j) = w;
    }
  }
  mode->derivative_ = DenseMatrix(size, size);
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j < size; ++j) {
      Real value = regime.A(i, j);
      for (int pair : pairs) value += regime.B(i, pair) * mode->y_(pair, j);
      mode->derivative_(i, j) = value;
    }
  }
  for (int i = m; i < size; ++i) {
    for (int j = m; j < size; ++j) mode->derivative_(i, j) = regime.W(i - m, j - m);
  }
  mode->has_least_element_ = IsNonsingularMMatrix(regime, pairs);
  const double norm = BalancedNorm(mode->derivative_) * horizon;
  mode->series_level_ = norm > kSeriesNorm ? static_cast<int>(std::ceil(std::log2(norm / kSeriesNorm))) : 0;
  return mode;
}

const DenseMatrix& Mode::Change(int level) {
  if (static_cast<int>(changes_.size()) <= level) changes_.resize(level + 1);
  if (changes_[level]) return *changes_[level];
  const int size = derivative_.rows();
  if (level < series_level_) {
    const DenseMatrix& half = Change(level + 1);
    DenseMatrix whole = half * half;
    for (int i = 0; i < size; ++i) {
      for (int j = 0; j < size; ++j) whole(i, j) += Real(2) * half(i, j);
    }
    changes_[level] = std::move(whole);
    return *changes_[level];
  }
  const Real step = Real(std::ldexp(horizon_, -level));
  DenseMatrix scaled = derivative_;
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) scaled(i, j) *= step;
  }
  DenseMatrix term = scaled, sum = scaled;
  for (int k = 2; k <= kSeriesTerms; ++k) {
    term = term * scaled;
    for (int i = 0; i < size; ++i) {
      for (int j = 0; j < size; ++j) {
        term(i, j) = term(i, j) / Real(k);
        sum(i, j) += term(i, j);
      }
    }
  }
  changes_[level] = std::move(sum);
  return *changes_[level];
}

Column Mode::After(const Column& z, int level) {
  Column result = Change(level) * z;
  for (size_t i = 0; i < z.size(); ++i) result[i] += z[i];
  return result;
}

Column Mode::SeriesAfter(const Column& z, Real time) const {
  Column term = z, sum = z;
  for (int k = 1; k <= kSeriesTerms; ++k) {
    term = derivative_ * term;
    const Real factor = time / Real(k);
    for (size_t i = 0; i < term.size(); ++i) {
      term[i] *= factor;
      sum[i] += term[i];
    }
  }
  return sum;
}

Column Mode::After(const Column& z, Real time) {
  Column result = z;
  Real rest = time;
  for (int level = 0; level <= series_level_; ++level) {
    const Real step = std::ldexp(horizon_, -level);
    while (rest >= step) {
      result = After(result, level);
      rest -= step;
    }
  }
  return IsZero(rest) ? result : SeriesAfter(result, rest);
}

}  // namespace dlcs::hostile
