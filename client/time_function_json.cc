// SPDX-License-Identifier: Apache-2.0
#include "client/time_function_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace dlcs::client {
namespace {

using nlohmann::json;

// A list with a formula or a number per component. Numbers alone are a constant; next to formulas they are
// written as formulas, with all their digits.
void ReadComponents(const json& value, const std::string& path, JsonReader& reader, v1::TimePiece& piece) {
  const bool all_numbers =
      std::all_of(value.begin(), value.end(), [](const json& v) { return v.is_number(); });
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
      reader.Refuse(
          fmt::format("{}[{}]", path, i),
          fmt::format("is {}; must be a formula in t (a string) or a number", DescribeJson(value[i])));
    }
  }
}

// On the wire the rows are flat: one of the wrong length would be read as something else.
bool HasRowsOf(int size, const v1::DenseMatrix& rows, const std::string& path, JsonReader& reader) {
  if (rows.columns() == size || size == 0) return true;
  reader.Refuse(path, fmt::format("has rows of {}; must have one value per component in each row, {} here",
                                  rows.columns(), size));
  return false;
}

void ReadSamples(const json& value, const std::string& path, int size, JsonReader& reader,
                 v1::TimePiece& piece) {
  reader.RefuseUnknownKeys(value, {"times", "values"}, path);
  const json* times = reader.Require(value, "times", fmt::format("{} needs the times of its samples", path));
  const json* values =
      reader.Require(value, "values", fmt::format("{} needs a row of values per time", path));
  if (times == nullptr || values == nullptr) return;
  const auto time_list = reader.ReadNumbers(*times, path + ".times");
  const auto rows = reader.ReadMatrix(*values, path + ".values");
  if (!time_list || !rows || !HasRowsOf(size, *rows, path + ".values", reader)) return;
  if (time_list->size() != static_cast<std::size_t>(rows->rows())) {
    reader.Refuse(path + ".values",
                  fmt::format("has {} rows but {}.times has {}; must hold one row of values per time",
                              rows->rows(), path, time_list->size()));
    return;
  }
  piece.mutable_samples()->mutable_times()->Add(time_list->begin(), time_list->end());
  *piece.mutable_samples()->mutable_values() = rows->values();
}

void ReadPolynomials(const json& value, const std::string& path, int size, JsonReader& reader,
                     v1::TimePiece& piece) {
  reader.RefuseUnknownKeys(value, {"breaks", "coefficients"}, path);
  const json* breaks =
      reader.Require(value, "breaks", fmt::format("{} needs the ends of its intervals", path));
  const json* coefficients =
      reader.Require(value, "coefficients", fmt::format("{} needs a list of rows per interval", path));
  if (breaks == nullptr || coefficients == nullptr) return;
  const auto break_list = reader.ReadNumbers(*breaks, path + ".breaks");
  if (!coefficients->is_array()) {
    reader.Refuse(
        path + ".coefficients",
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

void ReadZero(int size, v1::TimePiece& piece) {
  for (int i = 0; i < size; ++i) piece.mutable_constant()->add_values(0);
}

// One of f and g, in an object (`root` or a piece) at `prefix`.
void ReadPiece(const json& object, const std::string& key, const std::string& prefix, int size,
               JsonReader& reader, v1::TimePiece& piece) {
  const auto value = object.find(key);
  const std::string path = prefix + key;
  if (value == object.end()) {
    ReadZero(size, piece);
  } else if (value->is_array()) {
    ReadComponents(*value, path, reader, piece);
  } else if (value->is_object() && (value->contains("breaks") || value->contains("coefficients"))) {
    ReadPolynomials(*value, path, size, reader, piece);
  } else if (value->is_object()) {
    ReadSamples(*value, path, size, reader, piece);
  } else {
    reader.Refuse(path, fmt::format("is {}; must be a list with a formula or a number per component, as in "
                                    "[\"sin(t)\", 0], or an object with samples or polynomials",
                                    DescribeJson(*value)));
  }
}

}  // namespace

void ReadSources(const json& root, int states, int constraints, JsonReader& reader, v1::TimeFunction& f,
                 v1::TimeFunction& g) {
  const auto pieces = root.find("pieces");
  if (pieces == root.end()) {
    ReadPiece(root, "f", "", states, reader, *f.add_pieces());
    ReadPiece(root, "g", "", constraints, reader, *g.add_pieces());
    return;
  }
  if (!pieces->is_array() || pieces->empty()) {
    reader.Refuse("pieces",
                  fmt::format("is {}; must be a list of objects {{\"t0\": ..., \"f\": ..., \"g\": ...}}",
                              DescribeJson(*pieces)));
    return;
  }
  for (std::size_t k = 0; k < pieces->size(); ++k) {
    const json& piece = (*pieces)[k];
    const std::string path = fmt::format("pieces[{}]", k);
    if (!piece.is_object()) {
      reader.Refuse(path, fmt::format("is {}; must be an object {{\"t0\": ..., \"f\": ..., \"g\": ...}}",
                                      DescribeJson(piece)));
      continue;
    }
    reader.RefuseUnknownKeys(piece, {"t0", "f", "g"}, path);
    const auto t0 = piece.find("t0");
    if (t0 == piece.end()) {
      reader.Refuse(path, "has no \"t0\"; must say from when it holds");
      continue;
    }
    const double start = reader.ReadNumber(*t0, path + ".t0").value_or(0);
    ReadPiece(piece, "f", path + ".", states, reader, *f.add_pieces());
    ReadPiece(piece, "g", path + ".", constraints, reader, *g.add_pieces());
    f.mutable_pieces(f.pieces_size() - 1)->set_start(start);
    g.mutable_pieces(g.pieces_size() - 1)->set_start(start);
  }
}

}  // namespace dlcs::client
