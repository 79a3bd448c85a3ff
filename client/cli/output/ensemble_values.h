// SPDX-License-Identifier: Apache-2.0
// The results of an ensemble that ran as a job: what is kept of each member, and what all of them have in common.

#ifndef DLCS_CLIENT_CLI_OUTPUT_ENSEMBLE_VALUES_H_
#define DLCS_CLIENT_CLI_OUTPUT_ENSEMBLE_VALUES_H_

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "client/cli/output/result_arrays.h"
#include "dlcs/v1/jobs.pb.h"

namespace dlcs::client {

// "solved", "reached", "failed"; "missing" of a member without a result.
const char* OutcomeWord(v1::MemberOutcome outcome);

// "t", "error", "x1", "vC", "max(vC)", "w(D1)". All differ: a name that is taken, by an earlier column or by "member",
// "outcome" and "message", gets its kind in front, as in "output:t".
std::vector<std::string> ColumnNames(const v1::EnsembleProgress& ensemble);

// A header member,outcome and the columns, and a line for each member of a shard, or a JSON object for each. JSON has
// the message of failed members too, where it is kept.
void PrintShardCsvHeader(const v1::EnsembleProgress& ensemble, std::FILE* out);
void PrintShardCsvLines(const v1::EnsembleShard& shard, std::FILE* out);
void PrintShardJsonLines(const v1::EnsembleProgress& ensemble, const v1::EnsembleShard& shard, std::FILE* out);

// Holds all members, in their order. Not thread-safe.
class EnsembleValues {
 public:
  explicit EnsembleValues(v1::EnsembleProgress ensemble);

  void Add(const v1::EnsembleShard& shard);

  // How members ended and, for each column, the smallest, the mean and the largest value and quantiles over the members
  // that have one; the messages of failed members. Quantiles are exact: between two members they are interpolated.
  // Cost: sorts each column.
  void PrintTable(const std::string& title, int width, std::FILE* out) const;

  // As arrays that refer to this object: `values`, a row for each member and a column for each of `columns`, NaN where
  // there is none; `outcomes`, 1 solved, 2 reached, 3 failed, 0 missing; and the job as JSON text.
  ResultArrays Arrays(const v1::SolveJob& job) const;

 private:
  std::size_t columns() const { return static_cast<std::size_t>(ensemble_.columns_size()); }

  const v1::EnsembleProgress ensemble_;
  v1::EnsembleCounts counts_;
  std::vector<double> outcomes_;
  std::vector<double> values_;
  std::vector<v1::MemberFailure> failures_;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_ENSEMBLE_VALUES_H_
