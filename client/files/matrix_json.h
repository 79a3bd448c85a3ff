// SPDX-License-Identifier: Apache-2.0
// The forms that a matrix takes in files.

#ifndef DLCS_CLIENT_FILES_MATRIX_JSON_H_
#define DLCS_CLIENT_FILES_MATRIX_JSON_H_

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "client/files/json_reader.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Reads one of
//     [[1, 2], [3, 4]]                                                  all entries, row by row
//     {"rows": 3, "columns": 3, "entries": [[0, 1, 2.5], ...]}          [row, column, value], from 0; zero
//     elsewhere
//     {"rows": 3, "columns": 3, "row_indices": [...], "column_indices": [...], "values": [...]}     the same,
//     shorter
//     {"rows": 3, "diagonals": {"0": 4, "1": -1, "-1": [-1, -2]}}       above the main one from 1 on; a
//     number fills one
//     {"kronecker_sum": [F1, F2]}                                       F1 ⊗ I + I ⊗ F2, each in one of the
//     forms above
//     {"matrix_market": "A.mtx"}                                        a file, beside the one that is read
// `path` is the place for messages. Nothing, and a note, where it is none of them. Where `may_have_formulas` an entry
// of rows and of "entries" may be a formula, in double quotes.
std::optional<v1::Matrix> ReadAnyMatrix(const nlohmann::json& value, const std::string& path, JsonReader& reader,
                                        bool may_have_formulas = false);

// A list of numbers, or {"matrix_market": "x0.mtx"} of one column.
std::optional<std::vector<double>> ReadAnyVector(const nlohmann::json& value, const std::string& path,
                                                 JsonReader& reader);

// The shortest of these forms that keeps the structure of a sound matrix.
nlohmann::ordered_json MatrixJson(const v1::Matrix& matrix);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_MATRIX_JSON_H_
