// SPDX-License-Identifier: Apache-2.0
// The forms of a matrix in files.

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
//     {"rows": 3, "columns": 3, "entries": [[0, 1, 2.5], ...]}          [row, column, value], from 0; others are 0
//     {"rows": 3, "columns": 3, "row_indices": [...], "column_indices": [...], "values": [...]}
//                                                                       the same as three lists
//     {"rows": 3, "diagonals": {"0": 4, "1": -1, "-1": [-1, -2]}}       1 is above the main diagonal; a number
//                                                                       fills a diagonal
//     {"kronecker_sum": [F1, F2]}                                       F1 ⊗ I + I ⊗ F2, each in a form above
//     {"matrix_market": "A.mtx"}                                        a file, relative to the one that is read
//     {"file": "system.mat", "variable": "A"}                           an array of an .npy, .npz or .mat file,
//                                                                       relative likewise
// `path` is the place for messages. If the value has none of these forms, an error is recorded and nothing returned.
// If `may_have_formulas`, entries of rows and of "entries" may be formulas, as strings.
std::optional<v1::Matrix> ReadAnyMatrix(const nlohmann::json& value, const std::string& path, JsonReader& reader,
                                        bool may_have_formulas = false);

// A list of numbers, {"matrix_market": "x0.mtx"} of one column, or {"file": ...} of one column, one row, or a list.
std::optional<std::vector<double>> ReadAnyVector(const nlohmann::json& value, const std::string& path,
                                                 JsonReader& reader);

// The components of a dense or sparse matrix that has one column or, if it `may_be_row`, one row. If it has more, an
// error is recorded and nothing returned.
std::optional<std::vector<double>> VectorFrom(const v1::Matrix& matrix, bool may_be_row, const std::string& path,
                                              JsonReader& reader);

// The shortest of these forms that keeps the structure of a valid matrix.
nlohmann::ordered_json MatrixJson(const v1::Matrix& matrix);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_MATRIX_JSON_H_
