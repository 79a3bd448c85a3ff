// SPDX-License-Identifier: Apache-2.0
#include "client/files/matrix_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "client/files/array_file.h"
#include "client/files/matrix_market.h"
#include "proto/wire/matrix_shape.h"

namespace dlcs::client {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::int64_t kMaxRows = std::numeric_limits<std::int32_t>::max();
// Limit for matrices that a file describes by a rule: about a gigabyte.
constexpr std::int64_t kMaxEntries = std::int64_t{1} << 26;

constexpr const char* kForms =
    "must be a list of rows, or an object with entries, values, diagonals, kronecker_sum, matrix_market or file";

// A whole number in [least, limit).
std::optional<std::int32_t> ReadWhole(const json& value, std::int64_t least, std::int64_t limit,
                                      const std::string& path, JsonReader& reader, const char* hint = "") {
  if (value.is_number_integer() && value >= least && value < limit) return value.get<std::int32_t>();
  reader.Refuse(
      path, fmt::format("is {}; must be a whole number from {} to {}{}", DescribeJson(value), least, limit - 1, hint));
  return std::nullopt;
}

// The number of a row or column of `size`. Those who count from 1 meet this rule at the last one.
std::optional<std::int32_t> ReadIndex(const json& value, std::int64_t size, const std::string& path,
                                      JsonReader& reader) {
  return ReadWhole(value, 0, size, path, reader, ", since rows and columns count from 0");
}

std::optional<std::int32_t> ReadSize(const json& object, const std::string& key, const std::string& path,
                                     JsonReader& reader) {
  const json* value = reader.Require(object, key, fmt::format("{} needs its shape", path));
  if (value == nullptr) return std::nullopt;
  return ReadWhole(*value, 1, kMaxRows + 1, fmt::format("{}.{}", path, key), reader);
}

// A sparse matrix of the shape that `object` gives, without entries.
std::optional<v1::SparseMatrix> ReadShape(const json& object, const std::string& path, JsonReader& reader) {
  const auto rows = ReadSize(object, "rows", path, reader);
  const auto columns = ReadSize(object, "columns", path, reader);
  if (!rows || !columns) return std::nullopt;
  v1::SparseMatrix matrix;
  matrix.set_rows(*rows);
  matrix.set_columns(*columns);
  return matrix;
}

void AddEntry(std::int32_t row, std::int32_t column, double value, v1::SparseMatrix& matrix) {
  matrix.add_row_indices(row);
  matrix.add_column_indices(column);
  matrix.add_values(value);
}

std::optional<v1::SparseMatrix> ReadEntries(const json& object, const std::string& path, JsonReader& reader,
                                            bool may_have_formulas) {
  reader.RefuseUnknownKeys(object, {"rows", "columns", "entries"}, path);
  auto matrix = ReadShape(object, path, reader);
  const json& entries = object["entries"];
  const std::string place = path + ".entries";
  if (!entries.is_array()) {
    reader.Refuse(place, fmt::format("is {}; must be a list of [row, column, value]", DescribeJson(entries)));
    return std::nullopt;
  }
  if (!matrix) return std::nullopt;
  bool sound = true;
  for (std::size_t k = 0; k < entries.size(); ++k) {
    const json& entry = entries[k];
    const std::string entry_path = fmt::format("{}[{}]", place, k);
    if (!entry.is_array() || entry.size() != 3) {
      reader.Refuse(entry_path, fmt::format("is {}; must be [row, column, value]", DescribeJson(entry)));
      sound = false;
      continue;
    }
    const auto row = ReadIndex(entry[0], matrix->rows(), entry_path + "[0]", reader);
    const auto column = ReadIndex(entry[1], matrix->columns(), entry_path + "[1]", reader);
    std::string formula;
    const auto value = may_have_formulas ? reader.ReadEntry(entry[2], entry_path + "[2]", formula)
                                         : reader.ReadNumber(entry[2], entry_path + "[2]");
    sound = sound && row && column && value;
    if (sound && !formula.empty()) {
      v1::EntryFormula& by_formula = *matrix->add_formulas();
      by_formula.set_index(matrix->values_size());
      by_formula.set_formula(std::move(formula));
    }
    if (sound) AddEntry(*row, *column, *value, *matrix);
  }
  if (!sound) return std::nullopt;
  return matrix;
}

// Fills `indices`; whether all are whole and below `size`.
bool ReadIndices(const json& object, const std::string& key, std::int64_t size, const std::string& path,
                 JsonReader& reader, google::protobuf::RepeatedField<std::int32_t>& indices) {
  const json* list = reader.Require(object, key, fmt::format("{} needs an index for each of its values", path));
  if (list == nullptr) return false;
  const std::string place = fmt::format("{}.{}", path, key);
  if (!list->is_array()) {
    reader.Refuse(place, fmt::format("is {}; must be a list of whole numbers", DescribeJson(*list)));
    return false;
  }
  for (std::size_t k = 0; k < list->size(); ++k) {
    const auto index = ReadIndex((*list)[k], size, fmt::format("{}[{}]", place, k), reader);
    if (index) indices.Add(*index);
  }
  return static_cast<std::size_t>(indices.size()) == list->size();
}

std::optional<v1::SparseMatrix> ReadValues(const json& object, const std::string& path, JsonReader& reader) {
  reader.RefuseUnknownKeys(object, {"rows", "columns", "row_indices", "column_indices", "values"}, path);
  auto matrix = ReadShape(object, path, reader);
  const auto values = reader.ReadNumbers(object["values"], path + ".values");
  if (!matrix || !values) return std::nullopt;
  const bool rows = ReadIndices(object, "row_indices", matrix->rows(), path, reader, *matrix->mutable_row_indices());
  const bool columns =
      ReadIndices(object, "column_indices", matrix->columns(), path, reader, *matrix->mutable_column_indices());
  if (!rows || !columns) return std::nullopt;
  matrix->mutable_values()->Add(values->begin(), values->end());
  if (matrix->row_indices_size() == matrix->values_size() && matrix->column_indices_size() == matrix->values_size()) {
    return matrix;
  }
  reader.Refuse(path, fmt::format("has {} row_indices, {} column_indices and {} values; must have as many of each",
                                  matrix->row_indices_size(), matrix->column_indices_size(), matrix->values_size()));
  return std::nullopt;
}

// Diagonal `offset` of `matrix`: a number for all of it, or its values from the top.
bool ReadDiagonal(const json& value, std::int64_t offset, const std::string& path, JsonReader& reader,
                  v1::SparseMatrix& matrix) {
  const std::int64_t top = std::max<std::int64_t>(0, -offset);
  const std::int64_t left = std::max<std::int64_t>(0, offset);
  const std::int64_t length = std::min(matrix.rows() - top, matrix.columns() - left);
  if (length < 1) {
    reader.Refuse(path, fmt::format("lies outside the {} x {} matrix", matrix.rows(), matrix.columns()));
    return false;
  }
  if (matrix.values_size() + length > kMaxEntries) {
    reader.Refuse(path, fmt::format("makes more than {} entries", kMaxEntries));
    return false;
  }
  std::vector<double> values;
  if (value.is_number()) {
    values.assign(static_cast<std::size_t>(length), value.get<double>());
  } else if (auto list = reader.ReadNumbers(value, path)) {
    values = *std::move(list);
  } else {
    return false;
  }
  if (static_cast<std::int64_t>(values.size()) != length) {
    reader.Refuse(path, fmt::format("has {} values; must have {}, or be one number", values.size(), length));
    return false;
  }
  for (std::int64_t k = 0; k < length; ++k) {
    AddEntry(static_cast<std::int32_t>(top + k), static_cast<std::int32_t>(left + k),
             values[static_cast<std::size_t>(k)], matrix);
  }
  return true;
}

std::optional<v1::SparseMatrix> ReadDiagonals(const json& object, const std::string& path, JsonReader& reader) {
  reader.RefuseUnknownKeys(object, {"rows", "columns", "diagonals"}, path);
  const auto rows = ReadSize(object, "rows", path, reader);
  const auto columns = object.contains("columns") ? ReadSize(object, "columns", path, reader) : rows;
  const json& diagonals = object["diagonals"];
  const std::string place = path + ".diagonals";
  if (!diagonals.is_object()) {
    reader.Refuse(place,
                  fmt::format("is {}; must be an object, as in {{\"0\": 4, \"1\": -1}}", DescribeJson(diagonals)));
    return std::nullopt;
  }
  if (!rows || !columns) return std::nullopt;
  v1::SparseMatrix matrix;
  matrix.set_rows(*rows);
  matrix.set_columns(*columns);
  bool sound = true;
  for (const auto& [key, value] : diagonals.items()) {
    std::int32_t offset = 0;
    const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), offset);
    if (error != std::errc() || end != key.data() + key.size() || fmt::format("{}", offset) != key) {
      reader.Refuse(fmt::format("{}.\"{}\"", place, key.substr(0, 40)),
                    "is not a diagonal; \"0\" is the main one, \"1\" the one above it, \"-1\" the one below");
      sound = false;
      continue;
    }
    sound = ReadDiagonal(value, offset, fmt::format("{}.\"{}\"", place, key), reader, matrix) && sound;
  }
  if (!sound) return std::nullopt;
  return matrix;
}

// The file `name` in the folder of the file that is read.
std::string Beside(const JsonReader& reader, const std::string& name) {
  return (std::filesystem::path(reader.source()).parent_path() / name).string();
}

// The matrix in the file `name`, which is relative to the file that is read: read by rows if possible, otherwise by
// `read`.
template <typename Read>
std::optional<v1::Matrix> ReadByRowsOr(const std::string& name, const std::string& path, const std::string& key,
                                       JsonReader& reader, const Read& read) {
  if (!reader.matrix_files()) return read();
  auto by_rows = reader.matrix_files()(path, Beside(reader, name));
  if (!by_rows) return read();
  if (by_rows->ok()) return **std::move(by_rows);
  reader.Refuse(path + key, fmt::format("cannot be read: {}", std::string(by_rows->status().message())));
  return std::nullopt;
}

std::optional<v1::Matrix> ReadMarket(const json& object, const std::string& path, JsonReader& reader) {
  reader.RefuseUnknownKeys(object, {"matrix_market"}, path);
  const auto name = reader.ReadString(object["matrix_market"], path + ".matrix_market");
  if (!name) return std::nullopt;
  return ReadByRowsOr(*name, path, ".matrix_market", reader, [&]() -> std::optional<v1::Matrix> {
    auto matrix = ReadMatrixMarket(Beside(reader, *name));
    if (matrix.ok()) return *std::move(matrix);
    reader.Refuse(path + ".matrix_market", fmt::format("cannot be read: {}", std::string(matrix.status().message())));
    return std::nullopt;
  });
}

std::optional<StoredArray> ReadStored(const json& object, const std::string& path, JsonReader& reader) {
  reader.RefuseUnknownKeys(object, {"file", "variable"}, path);
  const auto name = reader.ReadString(object["file"], path + ".file");
  std::optional<std::string> variable;
  if (object.contains("variable")) {
    variable = reader.ReadString(object["variable"], path + ".variable");
    if (!variable) return std::nullopt;
  }
  if (!name) return std::nullopt;
  auto array = ReadStoredArray(Beside(reader, *name), variable);
  if (array.ok()) return *std::move(array);
  reader.Refuse(path + ".file", fmt::format("cannot be read: {}", std::string(array.status().message())));
  return std::nullopt;
}

std::optional<v1::Matrix> ReadStoredMatrix(const json& object, const std::string& path, JsonReader& reader) {
  const auto read_whole = [&]() -> std::optional<v1::Matrix> {
    auto array = ReadStored(object, path, reader);
    if (!array) return std::nullopt;
    if (array->dimensions == 2) return std::move(array->matrix);
    reader.Refuse(path, fmt::format("is an array of {} dimension{}; must be a matrix, of two", array->dimensions,
                                    array->dimensions == 1 ? "" : "s"));
    return std::nullopt;
  };
  if (!object["file"].is_string() || object.size() > 1) return read_whole();
  return ReadByRowsOr(object["file"].get<std::string>(), path, ".file", reader, read_whole);
}

std::optional<v1::Matrix> ReadSum(const json& object, const std::string& path, JsonReader& reader,
                                  bool may_have_formulas) {
  reader.RefuseUnknownKeys(object, {"kronecker_sum"}, path);
  const json& factors = object["kronecker_sum"];
  const std::string place = path + ".kronecker_sum";
  if (!factors.is_array() || factors.empty()) {
    reader.Refuse(place, fmt::format("is {}; must be a list of square matrices", DescribeJson(factors)));
    return std::nullopt;
  }
  v1::Matrix sum;
  for (std::size_t k = 0; k < factors.size(); ++k) {
    const std::string factor_path = fmt::format("{}[{}]", place, k);
    if (factors[k].is_object() && factors[k].contains("kronecker_sum")) {
      reader.Refuse(factor_path, "is a Kronecker sum; name all factors in one list");
      return std::nullopt;
    }
    auto factor = ReadAnyMatrix(factors[k], factor_path, reader, may_have_formulas);
    if (!factor) return std::nullopt;
    *sum.mutable_kronecker_sum()->add_factors() = *std::move(factor);
  }
  return sum;
}

std::optional<v1::Matrix> AsMatrix(std::optional<v1::SparseMatrix> sparse) {
  if (!sparse) return std::nullopt;
  v1::Matrix matrix;
  *matrix.mutable_sparse() = *std::move(sparse);
  return matrix;
}

// The formulas of `matrix` by the indices of their values.
template <typename AnyMatrix>
std::map<int, std::string> FormulasOf(const AnyMatrix& matrix) {
  std::map<int, std::string> formulas;
  for (const v1::EntryFormula& entry : matrix.formulas()) formulas.emplace(entry.index(), entry.formula());
  return formulas;
}

ordered_json RowsJson(const v1::DenseMatrix& dense) {
  const std::map<int, std::string> formulas = FormulasOf(dense);
  ordered_json rows = ordered_json::array();
  for (int i = 0; i < dense.rows(); ++i) {
    ordered_json row = ordered_json::array();
    for (int j = 0; j < dense.columns(); ++j) {
      const int k = i * dense.columns() + j;
      const auto formula = formulas.find(k);
      if (formula != formulas.end()) {
        row.push_back(formula->second);
      } else {
        row.push_back(dense.values(k) + 0.0);  // -0.0 becomes 0.0
      }
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

ordered_json EntriesJson(const v1::SparseMatrix& sparse) {
  const std::map<int, std::string> formulas = FormulasOf(sparse);
  ordered_json entries = ordered_json::array();
  for (int k = 0; k < sparse.values_size(); ++k) {
    const auto formula = formulas.find(k);
    ordered_json value = formula != formulas.end() ? ordered_json(formula->second) : ordered_json(sparse.values(k));
    entries.push_back({sparse.row_indices(k), sparse.column_indices(k), std::move(value)});
  }
  return {{"rows", sparse.rows()}, {"columns", sparse.columns()}, {"entries", std::move(entries)}};
}

}  // namespace

std::optional<v1::Matrix> ReadAnyMatrix(const json& value, const std::string& path, JsonReader& reader,
                                        bool may_have_formulas) {
  if (value.is_array()) {
    auto dense = reader.ReadMatrix(value, path, may_have_formulas);
    if (!dense) return std::nullopt;
    v1::Matrix matrix;
    *matrix.mutable_dense() = *std::move(dense);
    return matrix;
  }
  if (value.is_object()) {
    if (value.contains("entries")) return AsMatrix(ReadEntries(value, path, reader, may_have_formulas));
    if (value.contains("values")) return AsMatrix(ReadValues(value, path, reader));
    if (value.contains("diagonals")) return AsMatrix(ReadDiagonals(value, path, reader));
    if (value.contains("kronecker_sum")) return ReadSum(value, path, reader, may_have_formulas);
    if (value.contains("matrix_market")) return ReadMarket(value, path, reader);
    if (value.contains("file")) return ReadStoredMatrix(value, path, reader);
  }
  const std::string scalar = value.is_number() ? fmt::format("; a 1 x 1 matrix is written [[{}]]", value.dump()) : "";
  reader.Refuse(path, fmt::format("is {}; {}{}", DescribeJson(value), kForms, scalar));
  return std::nullopt;
}

std::optional<std::vector<double>> ReadAnyVector(const json& value, const std::string& path, JsonReader& reader) {
  if (value.is_object() && value.contains("matrix_market")) {
    const auto matrix = ReadMarket(value, path, reader);
    return matrix ? VectorFrom(*matrix, /*may_be_row=*/false, path, reader) : std::nullopt;
  }
  if (value.is_object() && value.contains("file")) {
    const auto array = ReadStored(value, path, reader);
    return array ? VectorFrom(array->matrix, /*may_be_row=*/true, path, reader) : std::nullopt;
  }
  return reader.ReadNumbers(value, path);
}

std::optional<std::vector<double>> VectorFrom(const v1::Matrix& matrix, bool may_be_row, const std::string& path,
                                              JsonReader& reader) {
  const auto [rows, columns] = ShapeOf(matrix);
  const bool is_row = may_be_row && rows == 1;
  if (columns != 1 && !is_row) {
    reader.Refuse(
        path, fmt::format("is a matrix of {} columns; must be one column{}", columns, may_be_row ? " or one row" : ""));
    return std::nullopt;
  }
  if (matrix.has_dense()) {
    return std::vector<double>(matrix.dense().values().begin(), matrix.dense().values().end());
  }
  const std::int64_t size = rows * columns;
  if (size > kMaxEntries) {
    reader.Refuse(path, fmt::format("has {} components; at most {} are possible", size, kMaxEntries));
    return std::nullopt;
  }
  const v1::SparseMatrix& sparse = matrix.sparse();
  std::vector<double> values(static_cast<std::size_t>(size), 0.0);
  for (int k = 0; k < sparse.values_size(); ++k) {
    values[static_cast<std::size_t>(is_row ? sparse.column_indices(k) : sparse.row_indices(k))] = sparse.values(k);
  }
  return values;
}

ordered_json MatrixJson(const v1::Matrix& matrix) {
  if (matrix.has_dense()) return RowsJson(matrix.dense());
  if (matrix.has_kronecker_sum()) {
    ordered_json factors = ordered_json::array();
    for (const v1::Matrix& factor : matrix.kronecker_sum().factors()) factors.push_back(MatrixJson(factor));
    return {{"kronecker_sum", std::move(factors)}};
  }
  const v1::SparseMatrix& sparse = matrix.sparse();
  if (!sparse.formulas().empty()) return EntriesJson(sparse);
  return {{"rows", sparse.rows()},
          {"columns", sparse.columns()},
          {"row_indices", sparse.row_indices()},
          {"column_indices", sparse.column_indices()},
          {"values", sparse.values()}};
}

}  // namespace dlcs::client
