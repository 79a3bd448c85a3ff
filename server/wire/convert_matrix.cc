// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/format_number.h"
#include "core/problem/formula.h"
#include "core/problem/violation_list.h"
#include "fmt/format.h"
#include "proto/wire/matrix_shape.h"
#include "server/wire/convert.h"
#include "server/wire/convert_dense.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Indices = google::protobuf::RepeatedField<std::int32_t>;

// The most errors reported for one list of indices.
constexpr int kMaxListed = 20;

// The value of an entry that is a formula; absent, with a violation, if it has none.
std::optional<double> EntryValue(const std::string& text, const NamesInFormulas& names, const std::string& field,
                                 std::vector<Violation>& violations) {
  absl::StatusOr<Formula> formula = Formula::Parse(names.InNumbers(text));
  if (!formula.ok()) {
    violations.push_back({field, fmt::format("{}: {}", Quoted(text), std::string(formula.status().message()))});
    return std::nullopt;
  }
  if (formula->DependsOnTime()) {
    violations.push_back({field, fmt::format("{}; depends on t, but matrix entries must be constant", Quoted(text))});
    return std::nullopt;
  }
  const double value = formula->Evaluate(0);
  if (std::isfinite(value)) return value;
  violations.push_back({field, fmt::format("{}; is {} and must be finite", Quoted(text), value)});
  return std::nullopt;
}

using EntryFormulas = google::protobuf::RepeatedPtrField<v1::EntryFormula>;

// Writes the values of `formulas` into `values`; `place_of` names the entry of an index in violations.
template <typename PlaceOf>
void PutFormulas(const EntryFormulas& formulas, const FormulaParameters* parameters, const std::string& field,
                 const PlaceOf& place_of, Doubles& values, std::vector<Violation>& violations) {
  if (formulas.empty()) return;
  if (parameters == nullptr) {
    violations.push_back({place_of(formulas[0].index()),
                          fmt::format("{}; must be a number: only matrices of a problem may have formulas as entries",
                                      Quoted(formulas[0].formula()))});
    return;
  }
  const NamesInFormulas names({}, *parameters);
  std::set<int> taken;
  int listed = 0;
  for (int k = 0; k < formulas.size() && listed < kMaxListed; ++k) {
    const int index = formulas[k].index();
    if (index < 0 || index >= values.size() || !taken.insert(index).second) {
      violations.push_back(
          {fmt::format("{}.formulas[{}].index", field, k),
           fmt::format("{}; must be at least 0, below {}, and different from earlier ones", index, values.size())});
      ++listed;
    } else if (const auto value = EntryValue(formulas[k].formula(), names, place_of(index), violations)) {
      values[index] = *value;
    } else {
      ++listed;
    }
  }
}

StructuredMatrix DenseFromProto(const v1::DenseMatrix& dense, const std::string& field,
                                std::vector<Violation>& violations, const FormulaParameters* parameters) {
  const Index rows = dense.rows();
  const Index columns = dense.columns();
  if (dense.values_size() != rows * columns) {
    violations.push_back(
        {field, fmt::format("{} values; {} x {} needs {}", dense.values_size(), rows, columns, rows * columns)});
    return {};
  }
  if (dense.formulas().empty()) return Matrix(Eigen::Map<const RowMajorMatrix>(dense.values().data(), rows, columns));
  Doubles values = dense.values();
  const auto place_of = [&](Index k) {
    return fmt::format("{}[{}][{}]", field, k / std::max<Index>(columns, 1), k % std::max<Index>(columns, 1));
  };
  PutFormulas(dense.formulas(), parameters, field, place_of, values, violations);
  return Matrix(Eigen::Map<const RowMajorMatrix>(values.data(), rows, columns));
}

void CheckIndices(const Indices& indices, Index size, const std::string& field, std::vector<Violation>& violations) {
  int listed = 0;
  for (int k = 0; k < indices.size() && listed < kMaxListed; ++k) {
    if (indices[k] >= 0 && indices[k] < size) continue;
    violations.push_back(
        {fmt::format("{}[{}]", field, k), fmt::format("{}; must be at least 0 and below {}", indices[k], size)});
    ++listed;
  }
}

// The first entry, in the order of positions, whose position occurs twice.
Violation SecondEntry(const v1::SparseMatrix& sparse, const std::string& field) {
  std::vector<int> order(static_cast<std::size_t>(sparse.values_size()));
  std::iota(order.begin(), order.end(), 0);
  const auto place = [&](int k) { return std::pair(sparse.column_indices(k), sparse.row_indices(k)); };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return place(a) < place(b); });
  const auto first = std::adjacent_find(order.begin(), order.end(), [&](int a, int b) { return place(a) == place(b); });
  return {fmt::format("{}.values[{}]", field, *std::next(first)),
          fmt::format("row {}, column {} is that of entry {} too, counted from 0; every position may occur only once",
                      sparse.row_indices(*first), sparse.column_indices(*first), *first)};
}

StructuredMatrix SparseFromProto(const v1::SparseMatrix& sparse, const std::string& field,
                                 std::vector<Violation>& violations, const FormulaParameters* parameters) {
  const int entries = sparse.values_size();
  if (sparse.row_indices_size() != entries || sparse.column_indices_size() != entries) {
    violations.push_back({field, fmt::format("{} row indices, {} column indices and {} values; must be as many of each",
                                             sparse.row_indices_size(), sparse.column_indices_size(), entries)});
    return {};
  }
  const std::size_t sound = violations.size();
  CheckIndices(sparse.row_indices(), sparse.rows(), field + ".row_indices", violations);
  CheckIndices(sparse.column_indices(), sparse.columns(), field + ".column_indices", violations);
  if (violations.size() > sound) return {};

  Doubles values;
  if (!sparse.formulas().empty()) {
    values = sparse.values();
    const auto place_of = [&](Index k) { return fmt::format("{}.values[{}]", field, k); };
    PutFormulas(sparse.formulas(), parameters, field, place_of, values, violations);
    if (violations.size() > sound) return {};
  }
  const double* const entry = values.empty() ? sparse.values().data() : values.data();
  std::vector<Eigen::Triplet<double>> triplets;
  triplets.reserve(static_cast<std::size_t>(entries));
  for (int k = 0; k < entries; ++k) {
    triplets.emplace_back(sparse.row_indices(k), sparse.column_indices(k), entry[k]);
  }
  SparseMatrix matrix(sparse.rows(), sparse.columns());
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  if (matrix.nonZeros() < entries) {
    violations.push_back(SecondEntry(sparse, field));
    return {};
  }
  return matrix;
}

// Nothing is allocated if one factor is not valid.
bool HasSoundFactors(const v1::KroneckerSum& sum, const std::string& field, std::vector<Violation>& violations) {
  const std::size_t sound = violations.size();
  if (sum.factors().empty()) violations.push_back({field, "no factors; must have at least one"});
  for (int k = 0; k < sum.factors_size(); ++k) {
    const std::string factor_field = fmt::format("{}.factors[{}]", field, k);
    const WireShape shape = ShapeOf(sum.factors(k));
    if (sum.factors(k).has_kronecker_sum()) {
      violations.push_back({factor_field, "a Kronecker sum; must be dense or sparse"});
    } else if (shape.rows != shape.columns || shape.rows < 1) {
      violations.push_back(
          {factor_field, ShapeText(shape.rows, shape.columns) + "; must be square, with at least one row"});
    }
  }
  return violations.size() == sound;
}

StructuredMatrix SumFromProto(const v1::KroneckerSum& sum, const std::string& field, std::vector<Violation>& violations,
                              const FormulaParameters* parameters) {
  if (!HasSoundFactors(sum, field, violations)) return {};
  const std::size_t sound = violations.size();
  KroneckerSum result;
  for (int k = 0; k < sum.factors_size(); ++k) {
    const auto factor =
        StructuredMatrixFromProto(sum.factors(k), fmt::format("{}.factors[{}]", field, k), violations, parameters);
    if (violations.size() == sound) result.factors.push_back(factor.Sparse());
  }
  if (violations.size() > sound) return {};
  return result;
}

v1::SparseMatrix SparseToProto(const SparseMatrix& matrix) {
  v1::SparseMatrix result;
  result.set_rows(static_cast<int>(matrix.rows()));
  result.set_columns(static_cast<int>(matrix.cols()));
  for (Index j = 0; j < matrix.outerSize(); ++j) {
    for (SparseMatrix::InnerIterator entry(matrix, j); entry; ++entry) {
      result.add_row_indices(static_cast<int>(entry.row()));
      result.add_column_indices(static_cast<int>(j));
      result.add_values(entry.value());
    }
  }
  return result;
}

}  // namespace

StructuredMatrix StructuredMatrixFromProto(const v1::Matrix& matrix, const std::string& field,
                                           std::vector<Violation>& violations, const FormulaParameters* parameters) {
  const WireShape shape = ShapeOf(matrix);
  constexpr std::int64_t kMaxRows = std::numeric_limits<std::int32_t>::max();
  if (shape.rows < 0 || shape.columns < 0) {
    violations.push_back({field, ShapeText(shape.rows, shape.columns) + "; the shape must not be negative"});
    return {};
  }
  if (shape.rows > kMaxRows || shape.columns > kMaxRows) {
    violations.push_back({field, fmt::format("{}; at most {} rows and columns are possible",
                                             ShapeText(shape.rows, shape.columns), kMaxRows)});
    return {};
  }
  switch (matrix.kind_case()) {
    case v1::Matrix::kDense:
      return DenseFromProto(matrix.dense(), field, violations, parameters);
    case v1::Matrix::kSparse:
      return SparseFromProto(matrix.sparse(), field + ".sparse", violations, parameters);
    case v1::Matrix::kKroneckerSum:
      return SumFromProto(matrix.kronecker_sum(), field + ".kronecker_sum", violations, parameters);
    case v1::Matrix::KIND_NOT_SET:
      break;
  }
  violations.push_back({field, "not set; must be one of dense, sparse, kronecker_sum"});
  return {};
}

Matrix MatrixFromProto(const v1::Matrix& matrix, const std::string& field, std::vector<Violation>& violations,
                       const FormulaParameters* parameters) {
  const WireShape shape = ShapeOf(matrix);
  if (shape.rows > 0 && shape.columns > StructuredMatrix::kMaxDenseEntries / shape.rows && !matrix.has_dense()) {
    violations.push_back(
        {field, fmt::format("{}; at most {} entries are possible here, where the matrix is stored as dense",
                            ShapeText(shape.rows, shape.columns), StructuredMatrix::kMaxDenseEntries)});
    return {};
  }
  return StructuredMatrixFromProto(matrix, field, violations, parameters).Dense();
}

v1::Matrix ToProto(const Matrix& matrix) {
  v1::Matrix result;
  v1::DenseMatrix& dense = *result.mutable_dense();
  dense.set_rows(static_cast<int>(matrix.rows()));
  dense.set_columns(static_cast<int>(matrix.cols()));
  Append(matrix.transpose(), *dense.mutable_values());
  return result;
}

v1::Matrix ToProto(const StructuredMatrix& matrix) {
  v1::Matrix result;
  if (matrix.is_dense()) return ToProto(matrix.Dense());
  if (const SparseMatrix* sparse = matrix.sparse()) {
    *result.mutable_sparse() = SparseToProto(*sparse);
  } else {
    for (const SparseMatrix& factor : matrix.kronecker_sum()->factors) {
      *result.mutable_kronecker_sum()->add_factors()->mutable_sparse() = SparseToProto(factor);
    }
  }
  return result;
}

}  // namespace dlcs
