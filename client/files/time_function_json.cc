// SPDX-License-Identifier: Apache-2.0
#include "client/files/time_function_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/files/matrix_json.h"
#include "proto/wire/matrix_shape.h"

namespace dlcs::client {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

// Limit of the zeros added for missing f or g, since a file of a few bytes may declare any number of components.
constexpr std::int64_t kMaxZeros = std::int64_t{1} << 26;

// A list with a formula or a number per component. Numbers alone are a constant; next to formulas they are
// written as formulas, with all their digits.
void ReadComponents(const json& value, const std::string& path, JsonReader& reader, v1::TimePiece& piece) {
  const bool all_numbers = std::all_of(value.begin(), value.end(), [](const json& v) { return v.is_number(); });
  if (all_numbers) {
    auto& values = *piece.mutable_constant()->mutable_values();
    for (const json& component : value) values.Add(component.get<double>());
    return;
  }
  auto& formulas = *piece.mutable_formulas()->mutable_formulas();
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (value[i].is_number()) {
      formulas.Add(fmt::format("{}", value[i].get<double>()));
    } else if (value[i].is_string()) {
      formulas.Add(value[i].get<std::string>());
    } else {
      reader.Refuse(fmt::format("{}[{}]", path, i),
                    fmt::format("is {}; must be a formula in t (a string) or a number", DescribeJson(value[i])));
    }
  }
}

// On the wire the rows are concatenated, so a row of the wrong length would shift the others.
bool HasRowsOf(int size, const v1::DenseMatrix& rows, const std::string& path, JsonReader& reader) {
  if (rows.columns() == size || size == 0) return true;
  reader.Refuse(path, fmt::format("has rows of {}; must have one value per component in each row, {} here",
                                  rows.columns(), size));
  return false;
}

void ReadSamples(const json& value, const std::string& path, int size, JsonReader& reader, v1::TimePiece& piece) {
  reader.RefuseUnknownKeys(value, {"times", "values"}, path);
  const json* times = reader.Require(value, "times", fmt::format("{} needs the times of its samples", path));
  const json* values = reader.Require(value, "values", fmt::format("{} needs a row of values per time", path));
  if (times == nullptr || values == nullptr) return;
  const auto time_list = reader.ReadNumbers(*times, path + ".times");
  const auto rows = reader.ReadMatrix(*values, path + ".values");
  if (!time_list || !rows || !HasRowsOf(size, *rows, path + ".values", reader)) return;
  if (time_list->size() != static_cast<std::size_t>(rows->rows())) {
    reader.Refuse(path + ".values", fmt::format("has {} rows but {}.times has {}; must hold one row of values per time",
                                                rows->rows(), path, time_list->size()));
    return;
  }
  piece.mutable_samples()->mutable_times()->Add(time_list->begin(), time_list->end());
  *piece.mutable_samples()->mutable_values() = rows->values();
}

void ReadPolynomials(const json& value, const std::string& path, int size, JsonReader& reader, v1::TimePiece& piece) {
  reader.RefuseUnknownKeys(value, {"breaks", "coefficients"}, path);
  const json* breaks = reader.Require(value, "breaks", fmt::format("{} needs the ends of its intervals", path));
  const json* coefficients =
      reader.Require(value, "coefficients", fmt::format("{} needs a list of rows per interval", path));
  if (breaks == nullptr || coefficients == nullptr) return;
  const auto break_list = reader.ReadNumbers(*breaks, path + ".breaks");
  if (!coefficients->is_array()) {
    reader.Refuse(path + ".coefficients",
                  fmt::format("is {}; must be a list with one polynomial per interval", DescribeJson(*coefficients)));
    return;
  }
  auto& polynomial = *piece.mutable_polynomial();
  if (break_list) polynomial.mutable_breaks()->Add(break_list->begin(), break_list->end());
  for (std::size_t p = 0; p < coefficients->size(); ++p) {
    const std::string place = fmt::format("{}.coefficients[{}]", path, p);
    const auto rows = reader.ReadMatrix((*coefficients)[p], place);
    if (!rows || !HasRowsOf(size, *rows, place, reader)) continue;
    *polynomial.add_coefficients()->mutable_values() = rows->values();
  }
}

// `zeros` counts those of the whole file.
void ReadZero(const std::string& path, int size, std::int64_t& zeros, JsonReader& reader, v1::TimePiece& piece) {
  if (zeros + size > kMaxZeros) {
    reader.Refuse(path,
                  fmt::format("is missing, and zero in {} components makes more than {} numbers", size, kMaxZeros));
    return;
  }
  zeros += size;
  piece.mutable_constant()->mutable_values()->Resize(size, 0);
}

void ReadSource(const json& value, const std::string& path, int size, JsonReader& reader, v1::TimePiece& piece) {
  if (value.is_array()) {
    ReadComponents(value, path, reader, piece);
  } else if (value.is_object() && (value.contains("breaks") || value.contains("coefficients"))) {
    ReadPolynomials(value, path, size, reader, piece);
  } else if (value.is_object()) {
    ReadSamples(value, path, size, reader, piece);
  } else {
    reader.Refuse(path, fmt::format("is {}; must be a list with a formula or a number per component, as in "
                                    "[\"sin(t)\", 0], or an object with samples or polynomials",
                                    DescribeJson(value)));
  }
}

// One of f and g, in a piece at `prefix`.
void ReadPiece(const json& object, const std::string& key, const std::string& prefix, int size, std::int64_t& zeros,
               JsonReader& reader, v1::TimePiece& piece) {
  const auto value = object.find(key);
  if (value == object.end()) {
    ReadZero(prefix + key, size, zeros, reader, piece);
  } else {
    ReadSource(*value, prefix + key, size, reader, piece);
  }
}

void ReadOwnPieces(const json& pieces, const std::string& path, int size, JsonReader& reader,
                   v1::TimeFunction& function) {
  if (!pieces.is_array() || pieces.empty()) {
    reader.Refuse(path,
                  fmt::format("is {}; must be a list of objects {{\"t0\": ..., \"of\": ...}}", DescribeJson(pieces)));
    return;
  }
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    const std::string place = fmt::format("{}[{}]", path, k);
    if (!pieces[k].is_object() || !pieces[k].contains("t0") || !pieces[k].contains("of")) {
      reader.Refuse(place,
                    fmt::format("is {}; must be an object {{\"t0\": ..., \"of\": ...}}", DescribeJson(pieces[k])));
      continue;
    }
    reader.RefuseUnknownKeys(pieces[k], {"t0", "of"}, place);
    v1::TimePiece& piece = *function.add_pieces();
    piece.set_start(reader.ReadNumber(pieces[k]["t0"], place + ".t0").value_or(0));
    ReadSource(pieces[k]["of"], place + ".of", size, reader, piece);
  }
}

// The function at `prefix` and its key: a source, or an object that is a matrix times one, or pieces of its own.
void ReadFunctionOrZeros(const json& root, const std::string& key, const std::string& prefix, int size,
                         std::int64_t& zeros, JsonReader& reader, v1::TimeFunction& function) {
  const auto value = root.find(key);
  const std::string path = prefix + key;
  const bool composed =
      value != root.end() && value->is_object() && (value->contains("matrix") || value->contains("pieces"));
  if (!composed) return ReadPiece(root, key, prefix, size, zeros, reader, *function.add_pieces());
  reader.RefuseUnknownKeys(*value, {"matrix", value->contains("pieces") ? "pieces" : "of"}, path);
  if (value->contains("matrix")) {
    const auto lift = ReadAnyMatrix((*value)["matrix"], path + ".matrix", reader);
    if (!lift) return;
    *function.mutable_lift() = *lift;
    size = static_cast<int>(std::clamp<std::int64_t>(ShapeOf(*lift).columns, 0, std::numeric_limits<int>::max()));
  }
  if (value->contains("pieces")) {
    ReadOwnPieces((*value)["pieces"], path + ".pieces", size, reader, function);
  } else if (const json* of =
                 reader.Require(*value, "of", fmt::format("{} needs the functions that its matrix multiplies", path))) {
    ReadSource(*of, path + ".of", size, reader, *function.add_pieces());
  }
}

// `values` as rows of `size`.
ordered_json RowsOf(const google::protobuf::RepeatedField<double>& values, int size) {
  ordered_json rows = ordered_json::array();
  for (int begin = 0; size > 0 && begin < values.size(); begin += size) {
    rows.push_back(std::vector<double>(values.begin() + begin, values.begin() + begin + size));
  }
  return rows;
}

ordered_json PieceJson(const v1::TimePiece& piece, int size) {
  if (piece.has_formulas()) return piece.formulas().formulas();
  if (piece.has_samples()) {
    return {{"times", piece.samples().times()}, {"values", RowsOf(piece.samples().values(), size)}};
  }
  if (piece.has_polynomial()) {
    ordered_json coefficients = ordered_json::array();
    for (const auto& one : piece.polynomial().coefficients()) coefficients.push_back(RowsOf(one.values(), size));
    return {{"breaks", piece.polynomial().breaks()}, {"coefficients", std::move(coefficients)}};
  }
  return piece.constant().values();
}

bool IsZero(const v1::TimeFunction& function) {
  return std::all_of(function.pieces().begin(), function.pieces().end(), [](const v1::TimePiece& piece) {
    const auto& values = piece.constant().values();
    return piece.has_constant() && std::all_of(values.begin(), values.end(), [](double v) { return v == 0; });
  });
}

}  // namespace

void ReadSources(const json& root, int states, int constraints, JsonReader& reader, v1::TimeFunction& f,
                 v1::TimeFunction& g) {
  std::int64_t zeros = 0;
  const auto pieces = root.find("pieces");
  if (pieces == root.end()) {
    ReadFunctionOrZeros(root, "f", "", states, zeros, reader, f);
    ReadFunctionOrZeros(root, "g", "", constraints, zeros, reader, g);
    return;
  }
  for (const char* key : {"f", "g"}) {
    if (root.contains(key)) {
      reader.Refuse(key,
                    "is given as well as pieces, which hold f and g; put it into the pieces, or leave the pieces out");
    }
  }
  if (!pieces->is_array() || pieces->empty()) {
    reader.Refuse("pieces", fmt::format("is {}; must be a list of objects {{\"t0\": ..., \"f\": ..., \"g\": ...}}",
                                        DescribeJson(*pieces)));
    return;
  }
  for (std::size_t k = 0; k < pieces->size(); ++k) {
    const json& piece = (*pieces)[k];
    const std::string path = fmt::format("pieces[{}]", k);
    if (!piece.is_object()) {
      reader.Refuse(
          path, fmt::format("is {}; must be an object {{\"t0\": ..., \"f\": ..., \"g\": ...}}", DescribeJson(piece)));
      continue;
    }
    reader.RefuseUnknownKeys(piece, {"t0", "f", "g"}, path);
    const auto t0 = piece.find("t0");
    if (t0 == piece.end()) {
      reader.Refuse(path, "has no \"t0\"; must be the time from which it is valid");
      continue;
    }
    const double start = reader.ReadNumber(*t0, path + ".t0").value_or(0);
    ReadPiece(piece, "f", path + ".", states, zeros, reader, *f.add_pieces());
    ReadPiece(piece, "g", path + ".", constraints, zeros, reader, *g.add_pieces());
    f.mutable_pieces(f.pieces_size() - 1)->set_start(start);
    g.mutable_pieces(g.pieces_size() - 1)->set_start(start);
  }
}

void ReadFunction(const json& object, const std::string& key, const std::string& prefix, int size, JsonReader& reader,
                  v1::TimeFunction& function) {
  std::int64_t zeros = 0;
  ReadFunctionOrZeros(object, key, prefix, size, zeros, reader, function);
}

ordered_json SourceJson(const v1::TimeFunction& function, int size) {
  if (IsZero(function)) return nullptr;
  if (function.has_lift()) size = static_cast<int>(ShapeOf(function.lift()).columns);
  ordered_json source = ordered_json::object();
  if (function.has_lift()) source["matrix"] = MatrixJson(function.lift());
  if (function.pieces_size() == 1) {
    ordered_json only = PieceJson(function.pieces(0), size);
    if (!function.has_lift()) return only;
    source["of"] = std::move(only);
    return source;
  }
  for (const v1::TimePiece& piece : function.pieces()) {
    source["pieces"].push_back({{"t0", piece.start()}, {"of", PieceJson(piece, size)}});
  }
  return source;
}

}  // namespace dlcs::client
