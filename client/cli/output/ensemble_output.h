// SPDX-License-Identifier: Apache-2.0
// Prints the members of an ensemble as a table or as CSV. (For JSON see message_json.h.)

#ifndef DLCS_CLIENT_CLI_OUTPUT_ENSEMBLE_OUTPUT_H_
#define DLCS_CLIENT_CLI_OUTPUT_ENSEMBLE_OUTPUT_H_

#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "client/result/backend.h"
#include "dlcs/v1/jobs.pb.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Keeps a line for each member, and prints them in the order of the members: outcome, time reached, LCP residual at
// nodes, estimated error, measurements, and the outputs or x at that time (at most the first 12). The messages of
// failed members follow. Not thread-safe.
class EnsembleTable {
 public:
  void Add(const MemberResult& member);
  void Print(const std::string& name, const v1::EnsembleSummary& summary, int width, std::FILE* out) const;

 private:
  struct Row {
    std::string label;
    bool success;
    std::string verdict;
    std::string message;
    double time;
    double error;  // NaN if not known
    v1::Certificate certificate;
    std::vector<std::string> measurements;  // as texts
    std::vector<double> values;             // the first outputs or components of x
  };
  DisplayNames names_;
  std::vector<std::string> measurement_names_;
  std::map<std::int64_t, Row> rows_;
};

// "98 solved, 2 failed"; counts of 0 are omitted.
std::string CountText(const v1::EnsembleSummary& summary);

// The same of an ensemble that is a job.
std::string CountText(const v1::EnsembleCounts& counts);
// Members that have an outcome.
std::int64_t Ended(const v1::EnsembleCounts& counts);

// A header member,label,t,x1,...,xm,y1,...,yn,w1,...,wn, or the names of these, and a line for each time of a member.
void PrintMemberCsvHeader(const DisplayNames& names, std::size_t states, std::size_t constraints, std::FILE* out);
void PrintMemberCsvLines(const MemberResult& member, std::FILE* out);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_ENSEMBLE_OUTPUT_H_
